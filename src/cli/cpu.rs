//! Before anything else: can this CPU run what the compiler made?
//!
//! `wide` chooses its instructions when it is compiled, and `.cargo/config.toml` asks for those of x86-64-v3. A CPU
//! without them would die of an illegal instruction without saying why, and so would most of this program's own code. The
//! check must not use what it asks for: no formatting, no collections, nothing that the compiler could turn into lanes.

/// Ends the process with advice if the CPU lacks an instruction set that this build uses.
#[inline(never)]
pub fn refuse_if_too_old() {
    #[cfg(target_arch = "x86_64")]
    x86::refuse_if_too_old();
}

/// Warns if the build leaves lanes of this CPU unused.
pub fn warn_if_too_plain() {
    #[cfg(target_arch = "x86_64")]
    if !cfg!(all(target_feature = "avx2", target_feature = "fma")) && x86::has_wide_lanes() {
        super::streams::line_to_stderr(format_args!(
            "warning: built without AVX2 and FMA, which this CPU has: rendering will be several times slower than \
             `{}` makes it",
            x86::BUILD_HERE
        ));
    }
}

/// What CPUID says. Other processors have one set of lanes, and `wide` uses it.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use raw_cpuid::native_cpuid::cpuid_count;
    use std::io::Write;

    /// `RUSTFLAGS` overrides what `.cargo/config.toml` pins.
    pub const BUILD_HERE: &str = "RUSTFLAGS='-C target-cpu=native' cargo build --release";

    /// Where CPUID keeps a feature.
    #[derive(Clone, Copy)]
    enum Leaf {
        Basic,
        Extended,
        Amd,
    }

    /// (name, does this build use it, place, bit): Intel's manual, volume 2A, CPUID; LZCNT is ABM of AMD's.
    macro_rules! for_each_feature {
        ($do:ident) => {
            $do!("AVX", "avx", Leaf::Basic, 28);
            $do!("FMA", "fma", Leaf::Basic, 12);
            $do!("F16C", "f16c", Leaf::Basic, 29);
            $do!("MOVBE", "movbe", Leaf::Basic, 22);
            $do!("AVX2", "avx2", Leaf::Extended, 5);
            $do!("BMI1", "bmi1", Leaf::Extended, 3);
            $do!("BMI2", "bmi2", Leaf::Extended, 8);
            $do!("AVX512F", "avx512f", Leaf::Extended, 16);
            $do!("AVX512DQ", "avx512dq", Leaf::Extended, 17);
            $do!("AVX512CD", "avx512cd", Leaf::Extended, 28);
            $do!("AVX512BW", "avx512bw", Leaf::Extended, 30);
            $do!("AVX512VL", "avx512vl", Leaf::Extended, 31);
            $do!("LZCNT", "lzcnt", Leaf::Amd, 5);
        };
    }

    /// Not to be put together with its likes in lanes.
    #[inline(never)]
    fn has(leaf: Leaf, bit: u32) -> bool {
        let register = match leaf {
            Leaf::Basic => cpuid_count(1, 0).ecx,
            Leaf::Extended if cpuid_count(0, 0).eax >= 7 => cpuid_count(7, 0).ebx,
            Leaf::Amd if cpuid_count(0x8000_0000, 0).eax > 0x8000_0000 => cpuid_count(0x8000_0001, 0).ecx,
            _ => 0,
        };
        register >> bit & 1 == 1
    }

    pub fn has_wide_lanes() -> bool {
        has(Leaf::Basic, 12) && has(Leaf::Extended, 5)
    }

    pub fn refuse_if_too_old() {
        let mut missing = false;
        macro_rules! look {
            ($name:literal, $feature:literal, $leaf:expr, $bit:literal) => {
                if cfg!(target_feature = $feature) && !has($leaf, $bit) {
                    say(if missing { ", " } else { "error: this CPU has no " });
                    say($name);
                    missing = true;
                }
            };
        }
        for_each_feature!(look);
        if missing {
            say("; this octray was built for newer CPUs: build it for this machine with `");
            say(BUILD_HERE);
            say("`\n");
            std::process::exit(3);
        }
    }

    /// The standard library is made for any x86-64.
    #[inline(never)]
    fn say(text: &str) {
        let _ = std::io::stderr().write_all(text.as_bytes());
    }
}
