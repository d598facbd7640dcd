//! Numbers on the command line.

use std::ops::RangeBounds;
use std::str::FromStr;

/// What reads an argument that must be in `range`; a message calls that `expected`.
pub fn number<T: FromStr + PartialOrd>(
    range: impl RangeBounds<T> + Clone,
    expected: &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| match text.parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!("expected {expected}")),
    }
}

/// A share, for `--gate`.
pub fn share(text: &str) -> Result<f64, String> {
    number(0.0..=1.0, "a share from 0 to 1")(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_in_no_range() {
        let finite = number(f64::MIN..=f64::MAX, "a finite number");
        assert_eq!(finite("-1e3"), Ok(-1e3));
        assert!(["inf", "-inf", "NaN", "", "1x"].iter().all(|text| finite(text).is_err()));
        let seconds = number(0.0.., "seconds");
        assert!(seconds("inf").is_ok() && seconds("NaN").is_err());
        assert_eq!(seconds("-1"), Err("expected seconds".into()));
    }
}
