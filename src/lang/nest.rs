//! Pairs directives with their `#end`, and writes the pairs down as jumps.

use super::{Diagnostic, Directive, Keyword, Mark, Program, Token};

/// The directive that a word names.
pub(super) fn directive_of(keyword: Keyword) -> Option<Directive> {
    Some(match keyword {
        Keyword::If => Directive::If,
        Keyword::Ifdef => Directive::Ifdef,
        Keyword::Ifndef => Directive::Ifndef,
        Keyword::Elseif => Directive::Elseif,
        Keyword::Else => Directive::Else,
        Keyword::End => Directive::EndBranch,
        Keyword::While => Directive::While,
        Keyword::For => Directive::For,
        Keyword::Switch => Directive::Switch,
        Keyword::Case => Directive::Case,
        Keyword::Range => Directive::Range,
        Keyword::Break => Directive::Break,
        Keyword::Macro => Directive::Macro,
        Keyword::Declare => Directive::Declare,
        Keyword::Local => Directive::Local,
        Keyword::Undef => Directive::Undef,
        Keyword::Include => Directive::Include,
        Keyword::Version => Directive::Version,
        Keyword::Default => Directive::Default,
        Keyword::Debug => Directive::Debug,
        Keyword::Warning => Directive::Warning,
        Keyword::Error => Directive::Error,
        Keyword::Render => Directive::Render,
        Keyword::Statistics => Directive::Statistics,
        Keyword::Fopen => Directive::Fopen,
        Keyword::Fclose => Directive::Fclose,
        Keyword::Read => Directive::Read,
        Keyword::Write => Directive::Write,
        _ => return None,
    })
}

/// A directive that waits for its `#end`.
struct Open {
    directive: Directive,
    /// Where it stands.
    at: usize,
    /// The last of its branches so far, whose jump is still to be filled in.
    branch: usize,
    /// Every `#break` that leaves it.
    breaks: Vec<usize>,
    /// The `#else` of an `#if` has come by: nothing but the `#end` should follow.
    has_else: bool,
}

/// Errors beyond this many are not told: they are all of one kind.
const ERRORS: usize = 50;

/// Fills in every jump. All errors of nesting are found in one pass. Where a macro's body is read by itself, `exit` is where
/// its end will be.
pub(super) fn nest(program: &mut Program, exit: Option<usize>) -> Result<(), Vec<Diagnostic>> {
    let mut open: Vec<Open> = Vec::new();
    let mut errors = Vec::new();
    for at in 0..program.tokens.len() {
        let directive = match program.tokens[at] {
            Token::Directive(directive, _) => directive,
            // Old style: these three may go without `#`. `default` needs its brace to be one.
            Token::Word(Keyword::Declare) => Directive::Declare,
            Token::Word(Keyword::Include) => Directive::Include,
            Token::Word(Keyword::Default)
                if program.tokens.get(at + 1) == Some(&Token::Mark(Mark::OpenBrace)) =>
            {
                Directive::Default
            }
            _ => continue,
        };
        program.tokens[at] = Token::Directive(directive, 0);
        match directive {
            Directive::If
            | Directive::Ifdef
            | Directive::Ifndef
            | Directive::While
            | Directive::For
            | Directive::Switch
            | Directive::Macro => {
                open.push(Open { directive, at, branch: at, breaks: Vec::new(), has_else: false })
            }
            Directive::Elseif | Directive::Else | Directive::Case | Directive::Range => {
                let switch = matches!(directive, Directive::Case | Directive::Range);
                match open.last_mut() {
                    Some(top) if top.may_have(directive) => {
                        let directive = match (directive, top.directive) {
                            (Directive::Else, Directive::Switch) => Directive::SwitchElse,
                            (Directive::Elseif | Directive::Else, _) if top.has_else => Directive::LateBranch,
                            _ => directive,
                        };
                        set_jump(program, top.branch, at);
                        program.tokens[at] = Token::Directive(directive, 0);
                        top.branch = at;
                        top.has_else |= directive == Directive::Else;
                    }
                    _ => {
                        let opener = if switch { "#switch" } else { "#if" };
                        let message =
                            format!("this directive belongs in an `{opener}`, found outside of one");
                        errors.push(Diagnostic::error(message, program.span(at)));
                    }
                }
            }
            Directive::Break => {
                let target = open.iter_mut().rev().find(|open| {
                    matches!(
                        open.directive,
                        Directive::While | Directive::For | Directive::Switch | Directive::Macro
                    )
                });
                match (target, exit) {
                    // Outside of its own loops a macro's `#break` leaves the macro (measured).
                    (Some(target), _) => target.breaks.push(at),
                    (None, Some(exit)) => set_jump(program, at, exit),
                    (None, None) => errors
                        .push(Diagnostic::error("`#break` outside of a loop or `#switch`", program.span(at))),
                }
            }
            Directive::EndBranch => match open.pop() {
                Some(done) => close(program, done, at),
                None => errors.push(Diagnostic::error(
                    "`#end` without a directive that it could end",
                    program.span(at),
                )),
            },
            _ => {}
        }
    }
    for left in open.into_iter().take(ERRORS) {
        let name = left.directive.name();
        errors.push(Diagnostic::error(format!("`#{name}` without its `#end`"), program.span(left.at)));
    }
    errors.truncate(ERRORS);
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Writes down the end of `done` at `at`.
fn close(program: &mut Program, done: Open, at: usize) {
    set_jump(program, done.branch, at);
    for leave in done.breaks {
        set_jump(program, leave, at);
    }
    let end = match done.directive {
        Directive::While => Directive::EndWhile,
        Directive::For => Directive::EndFor,
        Directive::Macro => Directive::EndMacro,
        _ => Directive::EndBranch,
    };
    program.tokens[at] = Token::Directive(end, done.at as u32);
}

fn set_jump(program: &mut Program, at: usize, to: usize) {
    if let Token::Directive(_, jump) = &mut program.tokens[at] {
        *jump = to as u32;
    }
}

impl Open {
    /// True if `branch` is one of its own.
    fn may_have(&self, branch: Directive) -> bool {
        match self.directive {
            Directive::If | Directive::Ifdef | Directive::Ifndef => {
                matches!(branch, Directive::Elseif | Directive::Else)
            }
            Directive::Switch => matches!(branch, Directive::Case | Directive::Range | Directive::Else),
            _ => false,
        }
    }
}

impl Directive {
    /// As it is written, without `#`.
    pub fn name(self) -> &'static str {
        use Directive::*;
        match self {
            If => "if",
            Ifdef => "ifdef",
            Ifndef => "ifndef",
            Elseif => "elseif",
            Else | LateBranch | SwitchElse => "else",
            EndBranch | EndWhile | EndFor | EndMacro => "end",
            While => "while",
            For => "for",
            Switch => "switch",
            Case => "case",
            Range => "range",
            Break => "break",
            Macro => "macro",
            Declare => "declare",
            Local => "local",
            Undef => "undef",
            Include => "include",
            Version => "version",
            Default => "default",
            Debug => "debug",
            Warning => "warning",
            Error => "error",
            Render => "render",
            Statistics => "statistics",
            Fopen => "fopen",
            Fclose => "fclose",
            Read => "read",
            Write => "write",
        }
    }
}
