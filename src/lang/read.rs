//! Text to [`Program`], by the grammar.

use super::{Diagnostic, FileId, Keyword, Mark, Program, Symbols, Token, nest::nest};
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
        // A few dozen lines at a time: pest keeps about 100 bytes a token until a parse is done.
        let rest = &text[at..];
        let Some(chunk) = SceneParser::parse(Rule::chunk, rest).ok().and_then(|mut pairs| pairs.next())
        else {
            break;
        };
        let len = chunk.as_span().end();
        for pair in chunk.into_inner() {
            take(pair, at as u32, &mut program, symbols);
        }
        if len == 0 {
            break;
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
            program.numbers.extend(pair.into_inner().map(|component| number(component.as_str())));
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

fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}
