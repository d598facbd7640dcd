//! Before anything else: can this CPU run what the compiler made?
//!
//! `wide` chooses its instructions when it is compiled, and `.cargo/config.toml` asks for those of the machine that
//! compiles. A CPU without them would die of an illegal instruction without saying why, and so would most of this program's own code. The
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

    /// `RUSTFLAGS`, if it is set, overrides what `.cargo/config.toml` pins.
    pub const BUILD_HERE: &str = "RUSTFLAGS='-C target-cpu=native' cargo build --release";

    /// Where CPUID keeps a feature: leaf, subleaf where there are several, register.
    #[derive(Clone, Copy)]
    enum Place {
        Leaf1Ecx,
        Leaf7Ebx,
        Leaf7Ecx,
        Leaf7Edx,
        Leaf7Sub1Eax,
        AmdEcx,
    }

    /// (name, does this build use it, place, bit): Intel's manual, volume 2A, CPUID; LZCNT is ABM of AMD's. Those that a compiler
    /// uses without being asked to.
    macro_rules! for_each_feature {
        ($do:ident) => {
            $do!("AVX", "avx", Place::Leaf1Ecx, 28);
            $do!("FMA", "fma", Place::Leaf1Ecx, 12);
            $do!("F16C", "f16c", Place::Leaf1Ecx, 29);
            $do!("MOVBE", "movbe", Place::Leaf1Ecx, 22);
            $do!("AVX2", "avx2", Place::Leaf7Ebx, 5);
            $do!("BMI1", "bmi1", Place::Leaf7Ebx, 3);
            $do!("BMI2", "bmi2", Place::Leaf7Ebx, 8);
            $do!("LZCNT", "lzcnt", Place::AmdEcx, 5);
            $do!("AVX512F", "avx512f", Place::Leaf7Ebx, 16);
            $do!("AVX512DQ", "avx512dq", Place::Leaf7Ebx, 17);
            $do!("AVX512_IFMA", "avx512ifma", Place::Leaf7Ebx, 21);
            $do!("AVX512CD", "avx512cd", Place::Leaf7Ebx, 28);
            $do!("AVX512BW", "avx512bw", Place::Leaf7Ebx, 30);
            $do!("AVX512VL", "avx512vl", Place::Leaf7Ebx, 31);
            $do!("AVX512_VBMI", "avx512vbmi", Place::Leaf7Ecx, 1);
            $do!("AVX512_VBMI2", "avx512vbmi2", Place::Leaf7Ecx, 6);
            $do!("GFNI", "gfni", Place::Leaf7Ecx, 8);
            $do!("AVX512_VNNI", "avx512vnni", Place::Leaf7Ecx, 11);
            $do!("AVX512_BITALG", "avx512bitalg", Place::Leaf7Ecx, 12);
            $do!("AVX512_VPOPCNTDQ", "avx512vpopcntdq", Place::Leaf7Ecx, 14);
            $do!("AVX512_FP16", "avx512fp16", Place::Leaf7Edx, 23);
            $do!("AVX_VNNI", "avxvnni", Place::Leaf7Sub1Eax, 4);
            $do!("AVX512_BF16", "avx512bf16", Place::Leaf7Sub1Eax, 5);
        };
    }

    /// Not to be put together with its likes in lanes.
    #[inline(never)]
    fn has(place: Place, bit: u32) -> bool {
        let known = |leaf: u32| cpuid_count(leaf & 0x8000_0000, 0).eax >= leaf;
        let register = match place {
            Place::Leaf1Ecx => cpuid_count(1, 0).ecx,
            Place::Leaf7Ebx if known(7) => cpuid_count(7, 0).ebx,
            Place::Leaf7Ecx if known(7) => cpuid_count(7, 0).ecx,
            Place::Leaf7Edx if known(7) => cpuid_count(7, 0).edx,
            Place::Leaf7Sub1Eax if known(7) && cpuid_count(7, 0).eax >= 1 => cpuid_count(7, 1).eax,
            Place::AmdEcx if known(0x8000_0001) => cpuid_count(0x8000_0001, 0).ecx,
            _ => 0,
        };
        register >> bit & 1 == 1
    }

    pub fn has_wide_lanes() -> bool {
        has(Place::Leaf1Ecx, 12) && has(Place::Leaf7Ebx, 5)
    }

    pub fn refuse_if_too_old() {
        let mut missing = false;
        macro_rules! look {
            ($name:literal, $feature:literal, $place:expr, $bit:literal) => {
                if cfg!(target_feature = $feature) && !has($place, $bit) {
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
