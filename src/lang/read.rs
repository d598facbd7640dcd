//! Text to [`Program`], by the grammar.

use super::{Diagnostic, FileId, Keyword, Mark, Program, Symbols, Token, data::scan, nest::nest};
use pest::Parser;
use pest::iterators::Pair;

#[derive(pest_derive::Parser)]
#[grammar = "../grammar/scene.pest"]
struct SceneParser;

/// Reads a whole text. Errors are only those of nesting (`#if` without `#end`, `#end` alone); any other text has
/// a program, whatever is in it.
pub fn read(file: FileId, text: &str, symbols: &mut Symbols) -> Result<Program, Vec<Diagnostic>> {
    let mut program = Program { file: Some(file), ..Program::default() };
    let mut at = 0;
    while at < text.len() {
        let data = scan(text, at, &mut program);
        if data > at {
            at = data;
            continue;
        }
        // A few dozen lines at a time: pest keeps about 100 bytes a token until a parse is done. A chunk ends
        // before a block comment or data at the latest.
        let rest = &text[at..];
        let rule = if rest.starts_with("/*") { Rule::block_comment } else { Rule::chunk };
        let parsed = SceneParser::parse(rule, rest);
        let Some(pair) =
            parsed.ok().and_then(|mut pairs| pairs.next()).filter(|pair| !pair.as_str().is_empty())
        else {
            let start = at as u32;
            let here = super::Span { file, start, end: start + 1 };
            return Err(vec![Diagnostic::error("this text cannot be read", here)]);
        };
        let len = pair.as_span().end();
        if pair.as_rule() == Rule::chunk {
            for pair in pair.into_inner() {
                take(pair, at as u32, &mut program, symbols);
            }
        } else {
            take(pair, at as u32, &mut program, symbols);
        }
        at += len;
    }
    program.tokens.push(Token::End);
    program.places.push((text.len() as u32, 0));
    nest(&mut program)?;
    Ok(program)
}

/// Adds the token of one pair; `base` is where the chunk begins.
fn take(pair: Pair<'_, Rule>, base: u32, program: &mut Program, symbols: &mut Symbols) {
    let span = pair.as_span();
    let text = span.as_str();
    let token = match pair.as_rule() {
        Rule::number => Token::Number(text.parse().unwrap_or(f64::NAN)),
        Rule::word => match Keyword::from_text(text) {
            Some(keyword) => Token::Word(keyword),
            None => Token::Name(symbols.intern(text)),
        },
        Rule::mark | Rule::bracket | Rule::data_mark => match Mark::from_text(text) {
            Some(mark) => Token::Mark(mark),
            None => Token::Junk(text.chars().next().unwrap_or(' ')),
        },
        Rule::vector => {
            let first = program.numbers.len();
            let components =
                pair.into_inner().map(|component| component.as_str().parse().unwrap_or(f64::NAN));
            program.numbers.extend(components);
            // Longer than any vector or polynomial; the evaluator says that it is too long.
            let count = (program.numbers.len() - first).min(usize::from(u16::MAX));
            Token::Vector(first as u32, count as u16)
        }
        Rule::string => {
            program.strings.push(text[1..text.len() - 1].into());
            Token::String(program.strings.len() as u32 - 1)
        }
        Rule::broken_string => Token::BrokenString,
        Rule::block_comment => match pair.into_inner().last().map(|inner| inner.as_rule()) {
            Some(Rule::unclosed) => Token::BrokenComment,
            _ => return,
        },
        Rule::directive => {
            let name = pair.into_inner().as_str();
            let name = name.trim_start_matches(['#', ' ', '\t', '\n', '\r']);
            match Keyword::from_text(name).and_then(super::nest::directive_of) {
                Some(directive) => Token::Directive(directive, 0),
                None => Token::Junk('#'),
            }
        }
        Rule::junk => Token::Junk(text.chars().next().unwrap_or(' ')),
        _ => return,
    };
    // A broken string or comment runs to the end of the file; point at its start only.
    let len = match token {
        Token::BrokenString => 1,
        Token::BrokenComment => 2,
        _ => text.len() as u32,
    };
    program.tokens.push(token);
    program.places.push((base + span.start() as u32, len));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::Directive;

    fn tokens(text: &str) -> Vec<Token> {
        let program = read(FileId(0), text, &mut Symbols::default()).expect("nesting is right");
        assert_eq!(program.tokens.len(), program.places.len());
        program.tokens
    }

    #[test]
    fn numbers_have_every_form() {
        for (text, value) in
            [("1", 1.0), ("1.", 1.0), (".5", 0.5), ("1e3", 1e3), ("1.5E-2", 1.5e-2), ("1.e5", 1e5)]
        {
            assert_eq!(tokens(text), [Token::Number(value), Token::End], "{text}");
        }
        // No exponent without digits.
        assert_eq!(tokens("1e").len(), 3);
    }

    #[test]
    fn vectors_of_numbers_are_one_token() {
        assert_eq!(tokens("<1, -2.5,\n 3>"), [Token::Vector(0, 3), Token::End]);
        assert_eq!(tokens("<1, 2> <3, 4>"), [Token::Vector(0, 2), Token::Vector(2, 2), Token::End]);
        for text in ["<1 2 3>", "<1, x, 3>", "<1>", "<1, 2,>", "(a < 1, 2"] {
            assert!(!tokens(text).iter().any(|t| matches!(t, Token::Vector(..))), "{text}");
        }
    }

    /// What the grammar's `data` makes of the beginning of a text: tokens, places, numbers, and where it ends.
    fn data_by_grammar(text: &str) -> (Program, usize) {
        let mut program = Program::default();
        let pair = SceneParser::parse(Rule::data, text).expect("may be empty").next().expect("one rule");
        let end = pair.as_span().end();
        pair.into_inner().for_each(|pair| take(pair, 0, &mut program, &mut Symbols::default()));
        (program, end)
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig::with_cases(2000))]
        #[test]
        fn data_are_scanned_as_the_grammar_says(
            text in "([<>{},.+/ex \\n-]|[0-9]{1,3}|<-?[0-9]{1,2}, ?-?[0-9]{0,2}\\.?[0-9]{0,18}(e-?[0-9]{1,3})?>){0,40}"
        ) {
            let (expected, end) = data_by_grammar(&text);
            let mut found = Program::default();
            proptest::prop_assert_eq!(scan(&text, 0, &mut found), end);
            proptest::prop_assert_eq!(&found.tokens, &expected.tokens);
            proptest::prop_assert_eq!(&found.places, &expected.places);
            let bits = |program: &Program| program.numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
            proptest::prop_assert_eq!(bits(&found), bits(&expected));
        }
    }

    #[test]
    fn blanks_and_comments_are_nothing() {
        for text in ["", " \t\r\n", "// x", "/* a /* b */ c */", "\u{feff}", "/**/", "/***/", "//\r//\n"] {
            assert_eq!(tokens(text), [Token::End], "{text:?}");
        }
        assert_eq!(tokens("/* /* */"), [Token::BrokenComment, Token::End]);
        assert_eq!(
            tokens("4/2"),
            [Token::Number(4.0), Token::Mark(Mark::Slash), Token::Number(2.0), Token::End]
        );
    }

    #[test]
    fn directives_know_where_to_go_on() {
        let jumps: Vec<_> = tokens("# if #else # \n end #while #break #end")
            .into_iter()
            .filter_map(|t| if let Token::Directive(d, jump) = t { Some((d, jump)) } else { None })
            .collect();
        use Directive::*;
        let expected = [(If, 1), (Else, 2), (EndBranch, 0), (While, 5), (Break, 5), (EndWhile, 3)];
        assert_eq!(jumps, expected);
    }

    #[test]
    fn places_are_byte_ranges_of_the_text() {
        let text = "sphere /* é */ { <0, 1, 2>, R }";
        let program = read(FileId(0), text, &mut Symbols::default()).expect("no directives");
        let parts: Vec<_> =
            program.places.iter().map(|&(at, len)| &text[at as usize..(at + len) as usize]).collect();
        assert_eq!(parts, ["sphere", "{", "<0, 1, 2>", ",", "R", "}", ""]);
    }
}
