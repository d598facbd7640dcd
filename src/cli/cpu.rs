//! Before anything is traced: can this CPU run what the compiler made?
//!
//! `wide` chooses its instructions when it is compiled, and `.cargo/config.toml` asks for those of x86-64-v3. A CPU
//! without them would die of an illegal instruction without saying why.

use super::Failure;

/// Fails with advice if the CPU lacks an instruction set that this build uses; warns if the build leaves lanes unused.
#[cfg(target_arch = "x86_64")]
pub fn check() -> Result<(), Failure> {
    let cpu = raw_cpuid::CpuId::new();
    let basic = cpu.get_feature_info();
    let extended = cpu.get_extended_feature_info();
    let has = |yes: Option<bool>| yes.unwrap_or(false);
    // (name, does this build use it, does this CPU have it)
    let sets = [
        ("AVX", cfg!(target_feature = "avx"), has(basic.as_ref().map(|f| f.has_avx()))),
        ("FMA", cfg!(target_feature = "fma"), has(basic.as_ref().map(|f| f.has_fma()))),
        ("F16C", cfg!(target_feature = "f16c"), has(basic.as_ref().map(|f| f.has_f16c()))),
        ("AVX2", cfg!(target_feature = "avx2"), has(extended.as_ref().map(|f| f.has_avx2()))),
        ("BMI1", cfg!(target_feature = "bmi1"), has(extended.as_ref().map(|f| f.has_bmi1()))),
        ("BMI2", cfg!(target_feature = "bmi2"), has(extended.as_ref().map(|f| f.has_bmi2()))),
    ];
    if let Some(message) = missing(&sets) {
        return Err(Failure::Machine(message));
    }
    let [_, fma, _, avx2, ..] = sets;
    if !(fma.1 && avx2.1) && fma.2 && avx2.2 {
        eprintln!(
            "warning: built without AVX2 and FMA, which this CPU has: rendering will be several times slower \
             than `{BUILD_HERE}` makes it"
        );
    }
    Ok(())
}

/// Other processors have one set of lanes, and `wide` uses it.
#[cfg(not(target_arch = "x86_64"))]
pub fn check() -> Result<(), Failure> {
    Ok(())
}

/// `RUSTFLAGS` overrides what `.cargo/config.toml` pins.
#[cfg(target_arch = "x86_64")]
const BUILD_HERE: &str = "RUSTFLAGS='-C target-cpu=native' cargo build --release";

#[cfg(target_arch = "x86_64")]
fn missing(sets: &[(&str, bool, bool)]) -> Option<String> {
    let names: Vec<_> =
        sets.iter().filter(|(_, used, there)| *used && !there).map(|(name, ..)| *name).collect();
    if names.is_empty() {
        return None;
    }
    Some(format!(
        "this octray was built for CPUs with AVX2 and FMA (2013 and later), and this one has no {}; build it for \
         this machine with `{BUILD_HERE}`",
        names.join(", ")
    ))
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    #[test]
    fn this_machine_can_run_its_own_build() {
        assert!(check().is_ok());
    }

    #[test]
    fn what_is_missing_is_named_with_a_way_out() {
        let said = missing(&[("AVX", true, true), ("AVX2", true, false), ("BMI2", false, false)]).unwrap();
        assert!(said.contains("no AVX2;") && said.contains("target-cpu=native"), "{said}");
        assert_eq!(missing(&[("AVX2", false, false), ("FMA", true, true)]), None);
    }
}
