//! Text to [`Program`], by the grammar.

use super::{
    Diagnostic, Directive, FileId, Keyword, Mark, Program, Span, Symbols, Token, nest::nest, plain::scan,
};
use pest::Parser;
use pest::iterators::Pair;

#[derive(pest_derive::Parser)]
#[grammar = "../grammar/scene.pest"]
struct SceneParser;

/// Of a usual text, with its blanks and comments.
const CHARACTERS_A_TOKEN: usize = 5;
/// Beyond this memory is asked for as it is needed.
const MANY_TOKENS: usize = 1 << 16;
/// Room for the tokens of a library's text with all that can wait: enough for most. What they do not take is given back, for the
/// next library. With a size for each the allocator would need half a megabyte for each size.
const TOKENS_SKIMMED: usize = 1 << 10;

/// How much of a text is cut into tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    /// All of it.
    Whole,
    /// Blocks and colours that are declared, and bodies of macros, are one token each ([`Token::Block`], [`Token::Body`]) until
    /// [`read_part`] is asked for theirs. For libraries: what is wrong in such a part is found if it is used.
    Skim,
}

/// Reads a whole text. Errors are only those of nesting (`#if` without `#end`, `#end` alone); any other text has
/// a program, whatever is in it.
pub fn read(
    file: FileId,
    text: &str,
    symbols: &mut Symbols,
    manner: Manner,
) -> Result<Program, Vec<Diagnostic>> {
    let mut program = Program { file: Some(file), ..Program::default() };
    let skim = manner == Manner::Skim;
    let tokens = match text.len() / CHARACTERS_A_TOKEN {
        _ if skim => TOKENS_SKIMMED,
        few @ ..MANY_TOKENS => few.next_power_of_two(),
        many => many,
    };
    program.tokens.reserve(tokens);
    program.places.reserve(tokens);
    tokenize(file, text, 0, &mut program, symbols, skim)?;
    if skim {
        program.tokens.shrink_to_fit();
        program.places.shrink_to_fit();
    }
    nest(&mut program, None)?;
    Ok(program)
}

/// Reads what was left of the text at a [`Token::Block`] or [`Token::Body`]. A block ends with a `;` of its own, at which whoever
/// reads its value stops; a body with the [`Directive::EndMacro`] that leaves it.
pub fn read_part(
    token: Token,
    part: Span,
    text: &str,
    symbols: &mut Symbols,
) -> Result<Program, Vec<Diagnostic>> {
    let mut program = Program { file: Some(part.file), ..Program::default() };
    tokenize(part.file, &text[..part.end as usize], part.start as usize, &mut program, symbols, false)?;
    let at = program.tokens.len() - 1;
    // A block has no directives.
    let (end, exit) = match token {
        Token::Body => (Token::Directive(Directive::EndMacro, 0), Some(at)),
        _ => (Token::Mark(Mark::Semicolon), None),
    };
    nest(&mut program, exit)?;
    program.tokens.insert(at, end);
    program.places.push((part.end, 0));
    Ok(program)
}

/// Adds the tokens of a text from byte `at` on.
fn tokenize(
    file: FileId,
    text: &str,
    mut at: usize,
    program: &mut Program,
    symbols: &mut Symbols,
    skim: bool,
) -> Result<(), Vec<Diagnostic>> {
    while at < text.len() {
        at = scan(text, at, program, symbols, skim);
        // What is left is one character that nobody writes.
        let Some(odd) = text[at..].chars().next() else { break };
        let parsed = SceneParser::parse(Rule::other, &text[at..at + odd.len_utf8()]);
        let Some(pair) =
            parsed.ok().and_then(|mut pairs| pairs.next()).filter(|pair| !pair.as_str().is_empty())
        else {
            let start = at as u32;
            let here = Span { file, start, end: start + 1 };
            return Err(vec![Diagnostic::error("this text cannot be read", here)]);
        };
        let len = pair.as_span().end();
        take(pair, at as u32, program, symbols);
        at += len;
    }
    program.tokens.push(Token::End);
    program.places.push((text.len() as u32, 0));
    Ok(())
}

/// Adds the token of one pair; `base` is where what was parsed begins.
fn take(pair: Pair<'_, Rule>, base: u32, program: &mut Program, symbols: &mut Symbols) {
    let span = pair.as_span();
    let text = span.as_str();
    let token = match pair.as_rule() {
        // Blanks have none inside.
        Rule::other => {
            pair.into_inner().for_each(|pair| take(pair, base, program, symbols));
            return;
        }
        Rule::number => Token::Number(number(text)),
        Rule::word => match Keyword::from_text(text) {
            Some(keyword) => Token::Word(keyword),
            None => Token::Name(symbols.intern(text)),
        },
        Rule::mark => match Mark::from_text(text) {
            Some(mark) => Token::Mark(mark),
            None => Token::Junk(text.chars().next().unwrap_or(' ')),
        },
        Rule::vector => {
            let first = program.numbers.len();
            let components = pair.into_inner().map(|component| number(component.as_str()));
            program.numbers.extend(components);
            // Longer than any vector or polynomial; the evaluator says that it is too long.
            let count = (program.numbers.len() - first).min(usize::from(u16::MAX));
            Token::Vector(first as u32, count as u16)
        }
        Rule::rows => {
            let first = program.numbers.len();
            let components = pair.into_inner().map(|component| number(component.as_str()));
            program.numbers.extend(components);
            Token::Rows(first as u32, ((program.numbers.len() - first) / 3) as u32)
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

/// The value of a number's text. An exponent without digits is none.
fn number(text: &str) -> f64 {
    text.trim_end_matches(['e', 'E', '+', '-']).parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::Directive;

    fn tokens(text: &str) -> Vec<Token> {
        let program =
            read(FileId(0), text, &mut Symbols::default(), Manner::Whole).expect("nesting is right");
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
        for (text, value) in
            [("1e", 1.0), ("2.5E+", 2.5), (".5e-", 0.5), ("123456789012345678901e", 123456789012345678901.0)]
        {
            assert_eq!(tokens(text), [Token::Number(value), Token::End], "{text}");
        }
    }

    #[test]
    fn vectors_of_numbers_are_one_token() {
        assert_eq!(tokens("<1, -2.5,\n 3>"), [Token::Vector(0, 3), Token::End]);
        assert_eq!(tokens("<1, 2> <3, 4>"), [Token::Vector(0, 2), Token::Vector(2, 2), Token::End]);
        for text in ["<1 2 3>", "<1, x, 3>", "<1>", "<1, 2,>", "(a < 1, 2"] {
            assert!(!tokens(text).iter().any(|t| matches!(t, Token::Vector(..))), "{text}");
        }
    }

    /// What the grammar alone makes of a text.
    fn by_grammar(text: &str) -> Program {
        let mut program = Program { file: Some(FileId(0)), ..Program::default() };
        let mut symbols = Symbols::default();
        let pair = SceneParser::parse(Rule::scene, text).expect("is total").next().expect("one rule");
        assert_eq!(pair.as_span().end(), text.len(), "is total");
        pair.into_inner().for_each(|pair| take(pair, 0, &mut program, &mut symbols));
        program.tokens.push(Token::End);
        program.places.push((text.len() as u32, 0));
        program
    }

    /// A token with what it indexes, but not its jump, and its place.
    fn shown(program: &Program, index: usize) -> String {
        let token = match program.tokens[index] {
            Token::Directive(directive, _) => format!("{directive:?}"),
            Token::Vector(first, count) => {
                format!("{:?}", &program.numbers[first as usize..][..count as usize])
            }
            Token::Rows(first, rows) => {
                format!("{:?}", &program.numbers[first as usize..][..3 * rows as usize])
            }
            Token::String(string) => format!("{:?}", program.strings[string as usize]),
            token => format!("{token:?}"),
        };
        format!("{token} {:?}", program.places[index])
    }

    /// The tokens of a skimmed program with those of its parts in their places.
    fn expanded(
        program: &Program,
        text: &str,
        symbols: &mut Symbols,
    ) -> Result<Vec<String>, Vec<Diagnostic>> {
        let mut tokens = Vec::new();
        for (index, token) in program.tokens.iter().enumerate() {
            let (Token::Block(_) | Token::Body) = token else {
                tokens.push(shown(program, index));
                continue;
            };
            let part = read_part(*token, program.span(index), text, symbols)?;
            // Without its own end.
            tokens.extend((0..part.tokens.len() - 2).map(|i| shown(&part, i)));
        }
        Ok(tokens)
    }

    /// Both ways of reading, before directives are paired.
    fn check_against_grammar(text: &str) {
        let expected = by_grammar(text);
        let mut found = Program { file: Some(FileId(0)), ..Program::default() };
        tokenize(FileId(0), text, 0, &mut found, &mut Symbols::default(), false).expect("is total");
        assert_eq!(found.tokens, expected.tokens, "{text:?}");
        assert_eq!(found.places, expected.places, "{text:?}");
        assert_eq!(found.strings, expected.strings, "{text:?}");
        let bits = |program: &Program| program.numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&expected), "{text:?}");
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig::with_cases(3000))]
        #[test]
        fn plain_text_is_scanned_as_the_grammar_says(
            text in "([<>{}()\\[\\],.+/*ex \\n#\"!=&|?:;\\\\é-]|[0-9]{1,3}|[a-z_]{1,2}|sphere|/\\*|\\*/|//|# ?if\
                     |<-?[0-9]{1,2}, ?-?[0-9]{0,2}\\.?[0-9]{0,18}(e-?[0-9]{1,3})?>){0,40}"
        ) {
            check_against_grammar(&text);
        }

        #[test]
        fn lists_of_vectors_are_scanned_as_the_grammar_says(
            text in "(vertex_vectors|normal_indices|uv_vectors) ?\\{? ?3 ?,? ?\
                     (<[0-9]{1,2}, ?-?[0-9](e9)?,[0-9]{1,2}>|<1,2>|<1,a,3>|, ?|\\*|\n|/\\*\\*/|\\}){0,20}"
        ) {
            check_against_grammar(&text);
        }

        #[test]
        fn what_is_skimmed_has_the_same_tokens_in_the_end(
            text in "(#declare [a-c] = ?(texture|sphere|color|rgb|camera) ?|# ?macro [a-c] ?\\([a-c, ]{0,3}\\)|#(if|while|for|end|else) \
                     |[{}()<>;,.+=\"# \n]|\\{|\\}|[0-9]|texture\\{\\}|//|/\\*|\\*/|<1,2>|default|x|é){0,30}"
        ) {
            let mut symbols = Symbols::default();
            let whole = read(FileId(0), &text, &mut symbols, Manner::Whole);
            let skimmed = read(FileId(0), &text, &mut symbols, Manner::Skim)
                .and_then(|skimmed| expanded(&skimmed, &text, &mut symbols));
            match (whole, skimmed) {
                (Ok(whole), Ok(skimmed)) => {
                    let expected: Vec<_> = (0..whole.tokens.len()).map(|i| shown(&whole, i)).collect();
                    assert_eq!(skimmed, expected, "{text:?}");
                }
                (whole, skimmed) => assert_eq!(whole.is_err(), skimmed.is_err(), "{text:?}"),
            }
        }

        #[test]
        fn any_text_is_scanned_as_the_grammar_says(text in "\\PC{0,60}") {
            check_against_grammar(&text);
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
        let program = read(FileId(0), text, &mut Symbols::default(), Manner::Whole).expect("no directives");
        let parts: Vec<_> =
            program.places.iter().map(|&(at, len)| &text[at as usize..(at + len) as usize]).collect();
        assert_eq!(parts, ["sphere", "{", "<0, 1, 2>", ",", "R", "}", ""]);
    }
}
