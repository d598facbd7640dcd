//! What of a library's text can wait: blocks and macro bodies that are found by their ends alone.
//!
//! In comes a text and a place in it; out goes where the block or body there ends, if it is one whose tokens nobody misses until
//! they are asked for. Most of what a scene includes it never uses, and to find an end takes a tenth of cutting into tokens.

use super::ends::{OF_WORDS, behind_gap, comment_end, line_end, string_end, word_end};
use super::nest::directive_of;
use super::{Directive, Keyword, Mark, Token};
use memchr::{memchr, memchr3, memmem};
use std::sync::LazyLock;

/// Words that are directives without a `#`, where they are followed by no `=`.
static BARE_DIRECTIVES: LazyLock<[memmem::Finder<'static>; 2]> =
    LazyLock::new(|| [memmem::Finder::new("default"), memmem::Finder::new("include")]);

/// True if `#declare Name =` is what the tokens end with.
pub(super) fn behind_declare(tokens: &[Token]) -> bool {
    matches!(tokens, [.., Token::Directive(Directive::Declare, _), Token::Name(_), Token::Mark(Mark::Equal)])
}

/// True if the tokens end with `#macro Name (` and parameters.
pub(super) fn behind_parameters(tokens: &[Token]) -> bool {
    let of_list = |token: &Token| matches!(token, Token::Name(_) | Token::Mark(Mark::Comma));
    let list = tokens.iter().rev().take_while(|token| of_list(token)).count();
    matches!(
        tokens[..tokens.len() - list],
        [.., Token::Directive(Directive::Macro, _), Token::Name(_), Token::Mark(Mark::OpenParen)]
    )
}

/// Where the value ends that `word` begins, which ends at `at`: its block, with all that follow it if they are the layers of
/// a texture; the `;` behind a colour.
///
/// `None` for words of other values and for those whose evaluation may do more than give a value, or may depend on more than
/// names' values: with a directive (`#`, or a bare `declare`, which has a `=`), a call (`(`) or a file's name (`"`).
pub(super) fn block_end(text: &str, word: Keyword, at: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    if is_color(word) {
        let end = at + bytes[at..].iter().position(|byte| TELLING_COLOR[usize::from(*byte)])?;
        return (bytes[end] == b';').then_some(end);
    }
    if word == Keyword::Function
        && let Some(end) = function_end(bytes, at)
    {
        return Some(end);
    }
    if !is_block(word) {
        return None;
    }
    let mut end = one_block_end(bytes, at)?;
    if word == Keyword::Texture {
        loop {
            let behind = behind_blanks(bytes, end)?;
            let next = word_end(bytes, behind);
            if &bytes[behind..next] != b"texture" {
                break;
            }
            end = one_block_end(bytes, next)?;
        }
    }
    let block = &bytes[at..end];
    BARE_DIRECTIVES.iter().all(|word| word.find(block).is_none()).then_some(end)
}

/// Where the `{ ... }` that is next ends.
fn one_block_end(bytes: &[u8], at: usize) -> Option<usize> {
    let mut at = behind_blanks(bytes, at)?;
    if bytes.get(at) != Some(&b'{') {
        return None;
    }
    let (start, mut open) = (at, 0usize);
    loop {
        at += memchr3(b'{', b'}', b'/', &bytes[at..])?;
        match bytes[at] {
            b'{' => open += 1,
            b'}' => {
                open -= 1;
                if open == 0 {
                    break;
                }
            }
            _ => {
                at = behind_comment(bytes, at)?;
                continue;
            }
        }
        at += 1;
    }
    at += 1;
    // Even in a comment: few have one there.
    let block = &bytes[start..at];
    (memchr3(b'#', b'(', b'"', block).is_none() && memchr(b'=', block).is_none()).then_some(at)
}

/// Where a function ends that is one of POV-Ray's own by its number: parameters if there are any, `{ internal(` and the number.
fn function_end(bytes: &[u8], at: usize) -> Option<usize> {
    let mut at = behind_gap(bytes, at);
    if bytes.get(at) == Some(&b'(') {
        let of_list = |byte: &u8| OF_WORDS[usize::from(*byte)] || b", ".contains(byte);
        at += 1;
        at += bytes[at..].iter().position(|byte| !of_list(byte))?;
        if bytes[at] != b')' {
            return None;
        }
        at = behind_gap(bytes, at + 1);
    }
    for part in [&b"{"[..], b"internal", b"("] {
        at = behind_gap(bytes, at);
        at = bytes[at..].starts_with(part).then_some(at + part.len())?;
    }
    at = word_end(bytes, behind_gap(bytes, at));
    for part in [b')', b'}'] {
        at = behind_gap(bytes, at);
        at = (bytes.get(at) == Some(&part)).then_some(at + 1)?;
    }
    Some(at)
}

/// What the value of a colour is looked through for.
const TELLING_COLOR: [bool; 256] = {
    let mut telling = [false; 256];
    let all = b";{}/#(\"=";
    let mut i = 0;
    while i < all.len() {
        telling[all[i] as usize] = true;
        i += 1;
    }
    telling
};

/// Where the body that begins at `at` ends: at the `#` of its `#end`.
pub(super) fn body_end(text: &str, mut at: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut open = 1;
    loop {
        at += memchr3(b'#', b'"', b'/', bytes.get(at..)?)?;
        match bytes[at] {
            b'/' => at = behind_comment(bytes, at)?,
            b'"' => match string_end(bytes, at + 1) {
                (end, true) => at = end + 1,
                _ => return None,
            },
            _ => {
                let start = behind_gap(bytes, at + 1);
                let end = word_end(bytes, start);
                use Directive::{EndBranch, For, If, Ifdef, Ifndef, Macro, Switch, While};
                match Keyword::from_text(&text[start..end]).and_then(directive_of) {
                    Some(If | Ifdef | Ifndef | While | For | Switch | Macro) => open += 1,
                    Some(EndBranch) => open -= 1,
                    _ => {}
                }
                if open == 0 {
                    return Some(at);
                }
                at = end.max(at + 1);
            }
        }
    }
}

/// Behind the comment at `at`, or behind the `/` if it begins none; `None` if it never ends.
fn behind_comment(bytes: &[u8], at: usize) -> Option<usize> {
    match bytes.get(at + 1) {
        Some(b'/') => Some(line_end(bytes, at)),
        Some(b'*') => comment_end(bytes, at),
        _ => Some(at + 1),
    }
}

/// Behind blanks and comments; `None` if one never ends.
fn behind_blanks(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        at = behind_gap(bytes, at);
        match (bytes.get(at), bytes.get(at + 1)) {
            (Some(b'/'), Some(b'/' | b'*')) => at = behind_comment(bytes, at)?,
            _ => return Some(at),
        }
    }
}

/// Words that begin a colour.
fn is_color(word: Keyword) -> bool {
    use Keyword as K;
    matches!(word, K::Rgb | K::Rgbf | K::Rgbt | K::Rgbft | K::Color | K::Colour)
}

/// Words that begin a value in braces.
fn is_block(word: Keyword) -> bool {
    use Keyword as K;
    matches!(
        word,
        K::Texture
            | K::Pigment
            | K::Finish
            | K::Normal
            | K::Material
            | K::Interior
            | K::ColorMap
            | K::ColourMap
            | K::PigmentMap
            | K::NormalMap
            | K::TextureMap
            | K::SlopeMap
            | K::Media
            | K::Density
            | K::DensityMap
            | K::SkySphere
            | K::Fog
            | K::Function
            | K::Object
            | K::Union
            | K::Merge
            | K::Intersection
            | K::Difference
            | K::Sphere
            | K::Plane
            | K::Box
            | K::Cylinder
            | K::Cone
            | K::Disc
            | K::Torus
            | K::Quadric
            | K::Quartic
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_without_side_effects_end_at_their_last_brace() {
        let end = |text: &str| block_end(text, Keyword::Texture, 0).map(|end| text[..end].to_string());
        for text in
            ["{}", " /* { */ { a { } // }\n }", "{ a }\n// b\ntexture { c } /**/ texture{}", "{ 1 / 2 }"]
        {
            assert_eq!(end(text).as_deref(), Some(text));
            assert_eq!(end(&format!("{text} ; textured {{}}")).as_deref(), Some(text));
        }
        for text in [
            "",
            " x",
            "{",
            "{ #if }",
            "{ f(x) }",
            "{ \"a\" }",
            "{ declare a = 1 }",
            "{ default {} }",
            "{ include a }",
            "{ /* }",
            "{} texture { M() }",
            "{} /*",
        ] {
            assert_eq!(end(text), None, "{text}");
        }
        assert_eq!(block_end("{}", Keyword::Camera, 0), None);
        let function = |text: &str| block_end(text, Keyword::Function, 0);
        for text in ["{internal(7)}", " (x, y,Z_1) { internal ( 7 ) }", "{ internal(N) }"] {
            assert_eq!(function(&format!("{text};")), Some(text.len()), "{text}");
        }
        for text in [
            "",
            "(",
            "(x",
            "(x) {",
            "{ internal(7) + x }",
            "{ internal(F()) }",
            "{ M(7) }",
            "(#if) { internal(7) }",
        ] {
            assert_eq!(function(text), None, "{text}");
        }
        assert_eq!(block_end(" <1, 2, 3> * A ; ;", Keyword::Rgb, 0), Some(15));
        for text in ["", " 1", " 1 #declare A = 2;", " M();", " 1 // ;"] {
            assert_eq!(block_end(text, Keyword::Rgb, 0), None, "{text}");
        }
    }

    #[test]
    fn bodies_end_at_their_own_end() {
        let body = |text: &str| body_end(text, 0).map(|end| text[..end].to_string());
        for text in
            ["", " a \"#end\\\"\" // #end\n /* #end */ / #x # #if(1) #else #end # while #end #macro #end "]
        {
            assert_eq!(body(&format!("{text}# end #end")).as_deref(), Some(text));
        }
        for text in ["", "a #if #end", "\"#end", "/* #end"] {
            assert_eq!(body(text), None, "{text}");
        }
    }
}
