//! Where what stands at a place of a text ends: words, lines, comments, strings, blanks.

use memchr::memchr2;

/// Characters of words.
pub(super) const OF_WORDS: [bool; 256] = {
    let mut of_words = [false; 256];
    let mut byte = 0;
    while byte < 256 {
        of_words[byte] = (byte as u8).is_ascii_alphanumeric() || byte as u8 == b'_';
        byte += 1;
    }
    of_words
};

/// Where the word at `at` ends.
pub(super) fn word_end(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    at + rest.iter().position(|byte| !OF_WORDS[usize::from(*byte)]).unwrap_or(rest.len())
}

/// Where the line that `at` is in ends.
pub(super) fn line_end(bytes: &[u8], at: usize) -> usize {
    memchr2(b'\n', b'\r', &bytes[at..]).map_or(bytes.len(), |len| at + len)
}

/// Where the nesting comment at `at` ends; `None` if it does not.
pub(super) fn comment_end(bytes: &[u8], at: usize) -> Option<usize> {
    let mut open = 1usize;
    let mut at = at + 2;
    while open > 0 {
        at += memchr2(b'/', b'*', bytes.get(at..)?)?;
        match (bytes[at], bytes.get(at + 1)) {
            (b'/', Some(b'*')) => open += 1,
            (b'*', Some(b'/')) => open -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
    }
    Some(at)
}

/// Where the text of the string that begins at `at` ends, and whether its quote is there.
pub(super) fn string_end(bytes: &[u8], mut at: usize) -> (usize, bool) {
    while let Some(len) = bytes.get(at..).and_then(|rest| memchr2(b'"', b'\\', rest)) {
        at += len;
        if bytes[at] == b'"' {
            return (at, true);
        }
        if at + 1 == bytes.len() {
            return (at, false);
        }
        at += 2;
    }
    (bytes.len(), false)
}

/// Where the blanks at `at` end.
pub(super) fn behind_gap(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    let blank = |byte: &u8| matches!(byte, b' ' | b'\t' | b'\n' | b'\r');
    at + rest.iter().position(|byte| !blank(byte)).unwrap_or(rest.len())
}
