//! Numbers on the command line, and what is reported of many.

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

/// The middle one, or the mean of the two in the middle.
pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    let (low, high) = (times.len().saturating_sub(1) / 2, times.len() / 2);
    times.get(low).zip(times.get(high)).map_or(0.0, |(a, b)| (a + b) / 2.0)
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

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!((median(vec![7.0]), median(vec![])), (7.0, 0.0));
    }
}
