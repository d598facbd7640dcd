//! Blocks of a library are read when somebody asks for them, and nobody can tell.

use octray::eval::{Evaluation, Options, Stream, from_text};
use octray::lang::Severity;
use octray::scene::PigmentKind;
use std::fs;

/// A scene with `#version 3.7` and the files of a library: `(name, text)`.
fn load(library: &[(&str, &str)], scene: &str) -> Evaluation {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in library {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let options = Options { library_paths: vec![folder.path().into()], ..Options::default() };
    let mut done = from_text("test.scn", &format!("#version 3.7; {scene}"), &options);
    // Names of folders that are different each time.
    for diagnostic in &mut done.diagnostics {
        diagnostic.message = diagnostic.message.replace(&*folder.path().to_string_lossy(), "");
    }
    done
}

/// The diagnostics: line and message, with the lines and messages of the way that led there.
fn told(done: &Evaluation) -> Vec<String> {
    let file = |id| done.sources.file(id).name.rsplit('/').next().unwrap_or_default().to_string();
    let place = |span: &Option<octray::lang::Span>| {
        span.map_or(String::new(), |span| format!("{}:{}: ", file(span.file), done.sources.position(span).0))
    };
    let tell = |d: &octray::lang::Diagnostic| {
        let notes: String =
            d.notes.iter().map(|(message, span)| format!(" | {}{message}", place(span))).collect();
        format!("{}{}{notes}", place(&d.span), d.message)
    };
    done.diagnostics.iter().map(tell).collect()
}

/// The red, green and blue of each object's pigment; nothing may be wrong.
fn colors(library: &[(&str, &str)], scene: &str) -> Vec<[f64; 3]> {
    let done = load(library, scene);
    assert_eq!(told(&done), [""; 0], "{scene}");
    let objects = done.scene.objects.iter();
    objects
        .map(|object| match &object.texture.as_ref().unwrap().layers[0].pigment.kind {
            PigmentKind::Solid(color) => color.rgb.to_array(),
            other => panic!("{other:?}"),
        })
        .collect()
}

const RED: [f64; 3] = [1.0, 0.0, 0.0];
const GREEN: [f64; 3] = [0.0, 1.0, 0.0];
const BLUE: [f64; 3] = [0.0, 0.0, 1.0];

#[test]
fn blocks_mean_what_their_names_stood_for() {
    let library =
        "#declare C = rgb <1, 0, 0>; #declare P = pigment { C } #declare T = texture { pigment { P } }
                   #declare K = 1;
                   #declare Q = pigment { rgb <K, 0, 0> } #declare Other = texture { pigment { rgb y } }";
    let library = &[("a.inc", library)];
    let ball = "sphere { 0, 1 texture { T } }";
    let table = [
        ("", RED),
        ("#declare C = rgb z;", RED),
        ("#declare P = pigment { rgb z }", RED),
        ("#undef C", RED),
        ("#undef P", RED),
        ("#for (C, 1, 3) #end", RED),
        ("#macro P() #end", RED),
        ("#declare Other = 1; #declare C = 2; #declare C = 3; #declare P = 4;", RED),
        ("#declare T = texture { pigment { rgb z } }", BLUE),
        ("#declare P = texture { pigment { P } }", RED),
    ];
    for (between, color) in table {
        assert_eq!(colors(library, &format!("#include \"a.inc\" {between} {ball}")), [color], "{between}");
    }
    // A variable written to in a loop, by reference, by a local that only hides it.
    let ball = "sphere { 0, 1 pigment { Q } }";
    let table = [
        "#while (K < 9) #declare K = K + 1; #end",
        "#macro Set(A) #declare A = 5; #end Set(K)",
        "#macro Hide() #local K = 7; sphere { 0, 1 pigment { Q } } #end Hide()",
        "#macro Again() #local K = 7; #declare K = 8; #end Again()",
    ];
    for between in table {
        let found = colors(library, &format!("#include \"a.inc\" {between} {ball}"));
        assert!(found.iter().all(|color| *color == RED), "{between}: {found:?}");
    }
    // An array's element.
    let library = "#declare A = array[2] { 1, 0 } #declare Q = pigment { rgb <A[0], A[1], 0> }";
    let scene = format!("#include \"a.inc\" #declare A[0] = 0; #declare A[1] = 1; {ball}");
    assert_eq!(colors(&[("a.inc", library)], &scene), [RED]);
}

#[test]
fn blocks_may_be_redeclared_from_themselves() {
    let library = "#declare T = texture { pigment { rgb x } finish { phong 1 } }
                   #declare T = texture { T pigment { rgb z } }
                   #declare C = rgb <0, 1, 0>; #declare C = color C + z;";
    let scene = "#include \"a.inc\" sphere { 0, 1 texture { T } } sphere { 0, 1 pigment { rgb C } }";
    assert_eq!(colors(&[("a.inc", library)], scene), [BLUE, [0.0, 1.0, 1.0]]);
    let done = load(&[("a.inc", library)], scene);
    assert_eq!(done.scene.objects[0].texture.as_ref().unwrap().layers[0].finish.phong, 1.0);
}

#[test]
fn includes_see_each_others_blocks_and_locals() {
    let first = "#include \"b.inc\" #declare T = texture { pigment { P } }";
    let second = "#declare P = pigment { rgb x } #local L = rgb y; #declare U = texture { pigment { L } }";
    let library = &[("a.inc", first), ("b.inc", second)];
    let scene =
        "#include \"a.inc\" #declare L = rgb z; sphere { 0, 1 texture { T } } sphere { 0, 1 texture { U } }
                 #ifdef (T) sphere { 0, 1 pigment { P } } #end #ifdef (L2) #error \"there is none\" #end";
    assert_eq!(colors(library, scene), [RED, GREEN, RED]);
}

#[test]
fn blocks_in_macros_and_loops_are_read_there() {
    let library = "#macro Make(C) #declare M = pigment { C } #end
                   #declare I = 0; #while (I < 3) #declare N = pigment { rgb <0, I / 2, 0> } #declare I = I + 1; #end
                   #declare J = 0; #while (J < 1) #declare J = J + 1; #declare O = pigment { rgb <J, 0, 0> } #end
                   #macro Two(A) #if (A) sphere { 0, 1 pigment { O } } #else sphere { 0, 1 pigment { N } } #end #end
                   #if (0) #declare N = pigment { nonsense } #end";
    let scene =
        "#include \"a.inc\" #declare J = 0; Make(rgb z) sphere { 0, 1 pigment { M } } Two(1) Two(0) Two(1)";
    assert_eq!(colors(&[("a.inc", library)], scene), [BLUE, RED, GREEN, RED]);
}

#[test]
fn blocks_keep_the_defaults_and_the_version_they_were_declared_under() {
    let library = "#default { finish { phong 0.25 } } #declare F = finish { specular 1 }
                   #declare O = sphere { 0, 1 texture { pigment { rgb x } } }
                   #version 3.5; #declare V = pigment { rgb version / 10 } #version 3.6;";
    let scene =
        "#include \"a.inc\" #default { finish { phong 0.5 } } #version 3.7; #default { pigment { rgb z } }
                 sphere { 0, 1 finish { F } } object { O } sphere { 0, 1 pigment { V } } sphere { 0, 1 }";
    let done = load(&[("a.inc", library)], scene);
    assert_eq!(told(&done), [""; 0]);
    let look = |i: usize| {
        let layer = &done.scene.objects[i].texture.as_ref().unwrap().layers[0];
        let PigmentKind::Solid(color) = &layer.pigment.kind else { panic!() };
        (color.rgb.to_array(), layer.finish.phong)
    };
    assert_eq!(look(0), (BLUE, 0.25));
    assert_eq!(look(1), (RED, 0.25));
    assert_eq!(look(2), ([0.35; 3], 0.5));
    assert_eq!(look(3), (BLUE, 0.5));
}

#[test]
fn what_is_wrong_in_a_block_is_told_where_it_stands_if_it_is_used() {
    let inner = "#declare Good = rgb x;\n#declare Bad = texture {\n pigment { rgb x }\n finish { glossy } }\n
                 #declare Chain = texture { Bad }\n#declare Early = pigment { Late }\n#declare Late = rgb y;";
    let library = &[("a.inc", "\n#include \"b.inc\""), ("b.inc", inner)];
    let include = "#include \"a.inc\"\n";
    assert_eq!(told(&load(library, &format!("{include} sphere {{ 0, 1 pigment {{ Good }} }}"))), [""; 0]);
    // Told once, however it is used.
    let uses = [
        "sphere { 0, 1 texture { Bad } } sphere { 0, 1 texture { Bad } }",
        "#macro M(T) #local x1 = 1; sphere { 0, 1 texture { T } } #end M(Bad)",
        "sphere { 0, 1 texture { Chain } }",
        "#declare Copy = Bad",
    ];
    for text in uses {
        let found = told(&load(library, &format!("{include}{text}")));
        let [error] = &found[..] else { panic!("{text}: {found:?}") };
        assert!(error.starts_with("b.inc:4: expected"), "{text}: {error}");
        assert!(error.contains("undeclared identifier `glossy`"), "{text}: {error}");
        let way = " | a.inc:2: in a file included here | test.scn:1: in a file included here";
        assert!(error.ends_with(way), "{text}: {error}");
    }
    // What was not there when the block was declared is not there for it.
    let found = told(&load(library, &format!("{include}sphere {{ 0, 1 pigment {{ Early }} }}")));
    let [error] = &found[..] else { panic!("{found:?}") };
    assert!(error.starts_with("b.inc:7: ") && error.contains("undeclared identifier `Late`"), "{error}");
}

#[test]
fn the_users_own_files_are_read_whole() {
    let done = load(&[], "#declare Bad = finish { glossy } #macro M() #break #end");
    assert!(done.count(Severity::Error) > 0);
}

#[test]
fn macros_of_a_library_are_read_when_they_are_called() {
    let library = "#macro Say(A, // B) #end
                     B) #debug \"#end\" /* #end */ #if (A > B) #debug str(A, 0, 0) #else #debug str(B, 0, 0) #end #end
                   #macro Plus() 1 + #end
                   #macro Define(N) #macro Inner() #debug \"in\" N #end #end
                   #macro Down(N) #if (N > 0) #debug str(N, 0, 0) Down(N - 1) #end #end
                   #macro Broken() #if (1) #end #else #end";
    let scene = "#include \"a.inc\" Say(1, 2) Say(4, 3) #debug str(Plus() 1, 0, 0) Down(3)";
    let done = load(&[("a.inc", library)], scene);
    assert_eq!(told(&done), [""; 0]);
    assert_eq!(done.stream(Stream::Debug), "#end2#end42321");
    let done = load(&[("a.inc", library)], "#include \"a.inc\" Broken()");
    assert_eq!(told(&done).len(), 1);
    assert!(told(&done)[0].starts_with("a.inc:6: this directive belongs"), "{:?}", told(&done));
}

#[test]
fn a_long_chain_of_blocks_is_no_deep_one() {
    let mut library = String::from("#declare T0 = texture { pigment { rgb x } }\n");
    for i in 1..3000 {
        library += &format!("#declare T{i} = texture {{ T{} }}\n", i - 1);
    }
    let scene = "#include \"a.inc\" sphere { 0, 1 texture { T2999 } }";
    assert_eq!(colors(&[("a.inc", &library)], scene), [RED]);
}

#[test]
fn a_macro_of_a_library_is_left_by_break() {
    let library = &[("a.inc", "#macro Leave() #debug \"a\" #if (1) #break #end #debug \"b\" #end")];
    let done = load(library, "#include \"a.inc\" #for (I, 0, 1) Leave() #debug \"x\" #end");
    assert_eq!(told(&done), [""; 0]);
    assert_eq!(done.stream(Stream::Debug), "axax");
}

#[test]
fn a_condition_ends_in_the_file_that_it_is_in() {
    for directive in [
        "#switch (3) #case (1",
        "#if (0",
        "#if (0) #elseif (0",
        "#while (0",
        "#switch (3) #range (1, 2",
        "#ifdef (A",
        "#ifndef (A",
    ] {
        let done = load(&[("a.inc", &format!("{directive} #end"))], "#include \"a.inc\" ) sphere { 0, 1 }");
        assert!(done.has_errors(), "{directive}: {:?}", told(&done));
    }
}
