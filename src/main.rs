//! The `octray` program: see [`cli`].

mod cli;

/// A scene is millions of small allocations on a thread of its own, where glibc's asks the kernel for each page.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    cli::refuse_if_too_old();
    cli::main()
}
