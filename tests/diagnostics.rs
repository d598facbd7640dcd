//! What is told of broken scenes. Each scene in `tests/diagnostics` says in comments (`//~ error: ...`) what must
//! be told of its line, and nothing else may be.

use octray::eval::{Limits, Options, from_text, load};
use octray::lang::{Diagnostic, Severity};
use octray::scene::{Object, Shape};
use std::path::Path;
use std::sync::Arc;

/// `(line, "error: message")`, in order of lines.
fn expected(text: &str) -> Vec<(usize, String)> {
    let lines = text.lines().enumerate();
    lines.filter_map(|(i, line)| Some((i + 1, line.split_once("//~ ")?.1.trim().to_string()))).collect()
}

#[test]
fn every_broken_scene_says_what_is_wrong() {
    let mut count = 0;
    let mut wrong = Vec::new();
    for entry in std::fs::read_dir("tests/diagnostics").unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let done = load(&path, &Options::default());
        let mut told: Vec<_> = done
            .diagnostics
            .iter()
            .map(|d| {
                (done.sources.position(d.span.unwrap()).0, format!("{}: {}", d.severity.word(), d.message))
            })
            .collect();
        told.sort();
        if told != expected(&text) {
            wrong.push(format!("{}\n told {told:#?}\n expected {:#?}", path.display(), expected(&text)));
        }
        // Whatever is told can be shown in every form.
        for diagnostic in &done.diagnostics {
            assert!(diagnostic.short(&done.sources).contains(&diagnostic.message));
            assert!(diagnostic.render(&done.sources, false).contains(&diagnostic.message));
            let json: serde_json::Value = serde_json::from_str(&diagnostic.json(&done.sources)).unwrap();
            assert_eq!(json["message"], diagnostic.message.as_str());
            assert_eq!(json["place"]["line"], done.sources.position(diagnostic.span.unwrap()).0);
        }
        count += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 34, "only {count} scenes in tests/diagnostics");
}

#[test]
fn a_folder_or_a_missing_file_is_no_scene() {
    for path in ["tests", "tests/no_such_scene.scn"] {
        let done = load(Path::new(path), &Options::default());
        assert!(done.has_errors());
        assert!(done.diagnostics[0].message.contains(path), "{}", done.diagnostics[0].message);
    }
}

#[test]
fn diagnostics_show_the_line_the_help_and_the_way_there() {
    let text = "#macro Ball(R)\n  sphere { 0, Radus }\n#end\n#declare Radius = 1;\nunion { Ball(1) sphere { 1, 1 } }\n";
    let done = from_text("balls.scn", text, &Options::default());
    let shown = "\
error: undeclared identifier `Radus`
 --> balls.scn:2:15
  |
2 |   sphere { 0, Radus }
  |               ^^^^^
  |
  = help: there is `Radius`
note: in macro `Ball`, called here
 --> balls.scn:5:9
  |
5 | union { Ball(1) sphere { 1, 1 } }
  |         ^^^^";
    assert_eq!(done.diagnostics[0].render(&done.sources, false), shown);
    assert_eq!(
        done.diagnostics[0].short(&done.sources),
        "balls.scn:2:15: error: undeclared identifier `Radus`"
    );
}

#[test]
fn what_is_not_modelled_can_be_left_out() {
    let text = "fog { distance 1 } sphere { 0, 1 } blob { threshold 1 }";
    let strict = from_text("test.scn", text, &Options::default());
    assert_eq!(strict.count(Severity::Error), 2);
    let lenient = from_text("test.scn", text, &Options { allow_missing: true, ..Options::default() });
    assert!(!lenient.has_errors());
    assert_eq!(lenient.count(Severity::Warning), 2);
    // The blob is in the scene, as something that no engine renders.
    let rendered = |object: &&Arc<Object>| !matches!(object.shape, Shape::Other(_));
    assert_eq!(lenient.scene.objects.len(), 2);
    assert_eq!(lenient.scene.objects.iter().filter(rendered).count(), 1);
}

/// Scripts that would not end or would eat the machine are stopped, in reasonable time and space.
#[test]
fn no_script_is_endless() {
    let limits = Limits { steps: 1_000_000, memory: 64 << 20, ..Limits::default() };
    let options = Options { limits, ..Options::default() };
    let scripts = [
        "#while (1) #end",
        "#while (1) sphere { 0, 1 } #end",
        "#while (1) #debug \"\" #end",
        "#for (I, 0, 1e9) #declare A = I; #end",
        "#declare S = \"aaaaaaaaaaaaaaaa\" #while (1) #declare S = concat(S, S) #end",
        "#declare A = array[1000000000][1000]",
        "#macro A(X) A(A(X)) #end A(1)",
        "#macro A() A() #end A()",
        "#macro A() A() A() #end A()",
        "#declare A = sphere { 0, 1 } #while (1) #declare A = union { object { A } } #end",
        "#declare A = sphere { 0, 1 } #while (1) #declare A = sphere { 0, 1 clipped_by { object { A } } } #end",
        "#declare A = sphere { 0, 1 } #while (1) #declare A = union { light_source { 0, 1 looks_like { A } } } #end",
        "#declare A = light_source { 0, 1 } #while (1) #declare A = light_source { 0, 1 looks_like { A } } #end",
        "#declare A = union { light_source { 0, 1 } } #while (1) #declare A = union { object { A } object { A } } #end",
        "#declare A = sphere { 0, 1 } #for (I, 1, 40) #declare A = union { object { A } object { A } } #end
         #declare B = min_extent(A);",
        "#declare A = sphere { 0, 1 } #for (I, 1, 40) #declare A = union { object { A } object { A } } #end
         #declare B = inside(A, 0);",
        "#declare A = sphere { 0, 1 }
         #for (I, 1, 40) #declare A = sphere { 0, 1 clipped_by { object { A } object { A } } } #end
         #declare B = union { object { A } }",
        "#declare A = sphere { 0, 1 }
         #for (I, 1, 40) #declare A = sphere { 0, 1 clipped_by { object { A } object { A } } } #end
         #declare B = min_extent(A);",
        "#while (1) #fopen F \"a.tmp\" write #fclose F #include \"a.tmp\" #end",
        "#while (1) #fopen F \"a.tmp\" write #fclose F #fopen F \"a.tmp\" read #end",
        "#fopen F \"a.tmp\" write #write (F, \"#include \\\"a.tmp\\\"\") #fclose F #include \"a.tmp\"",
        "#macro A() #switch (1) A() #case (1) #end #end A()",
        "#while (1) #switch (1) #break #case (1) #end #end",
        "#declare A = smooth_triangle { 0, x + z, x, y + z, y, z }
         #for (I, 1, 40) #declare A = union { object { A } object { A } scale 2 } #end",
        "#declare T = texture { pigment { rgbt 1 } } #while (1) #declare T = texture { T } texture { T } #end",
        "#declare A = array[1] { 1 } #while (1) #declare A = array[1] { A } #end",
        "#declare A = array[2] #while (1) #declare A[0] = A; #end",
        "#declare A = array[1000] #declare B = array[1000000]
         #for (I, 0, 999) #declare A[I] = B; #declare A[I][0] = 1; #end",
    ];
    for script in scripts {
        assert!(from_text("test.scn", script, &options).has_errors(), "{script}");
    }
}

/// There are 2^40 ways to the ball.
#[test]
fn finishes_of_shared_parts_are_asked_once() {
    let text = "#declare A = sphere { 0, 1 finish { ior 1.5 } }
        #for (I, 1, 40) #declare A = union { object { A } object { A } } #end object { A }";
    let done = from_text("test.scn", text, &Options::default());
    assert_eq!(done.scene.objects[0].interior.as_ref().unwrap().ior, 1.5);
}

/// Empty texts were charged nothing: half a minute of them took all memory there was.
#[test]
fn messages_count_as_memory() {
    let limits = Limits { memory: 1 << 20, ..Limits::default() };
    let options = Options { limits, ..Options::default() };
    for stream in ["debug", "warning", "render", "statistics"] {
        let found = from_text("test.scn", &format!("#while (1) #{stream} \"\" #end"), &options);
        let said = |d: &Diagnostic| d.message.contains("need more than 1 MB");
        assert!(found.diagnostics.iter().any(said), "{stream}: {:?}", found.diagnostics);
    }
}

/// No nesting of any kind overflows a stack or takes more than linear time: these would hang or crash if one did.
#[test]
fn no_text_is_too_deep() {
    let n = 100_000;
    let repeated = [
        "(",
        "{",
        "[",
        "<",
        "<1,",
        "-",
        "/*",
        "\"\\",
        "#if (1) ",
        "#end ",
        "#",
        "union { ",
        "texture { ",
        "concat(",
        "(1 ? ",
        "#declare A = ",
        "#macro A() ",
        "#switch (1) #case (1) ",
        "1e",
        ".",
        "<1,2",
        "#while (1",
        "\\",
        "A[",
        "#undef A[",
        "#ifdef (A[",
    ];
    for part in repeated {
        from_text("deep.scn", &part.repeat(n), &Options::default());
        let array = format!("#declare A = array[1] {{ 0 }};\n#declare B = {}", part.repeat(n));
        from_text("deep.scn", &array, &Options::default());
        from_text("deep.scn", &format!("#declare A = {}", part.repeat(n)), &Options::default());
    }
    let branches = format!("#if (0) {} #end", "#elseif (0) ".repeat(30 * n));
    from_text("deep.scn", &branches, &Options::default());
    let balanced = format!("{} sphere {{ 0, 1 }}", "/*".repeat(n) + &"*/".repeat(n));
    assert_eq!(from_text("deep.scn", &balanced, &Options::default()).scene.objects.len(), 1);
}

/// What was told of a text with the advice that the program asks for.
fn advice(text: &str) -> Vec<String> {
    let done = from_text("scene", text, &Options { advise: true, ..Options::default() });
    done.diagnostics.iter().map(|d| d.short(&done.sources)).collect()
}

#[test]
fn what_a_whole_scene_lacks_is_told_at_its_end() {
    let told = advice("plane { y, 0 }").join("\n");
    for part in ["no `#version`", "without gamma correction", "no `camera`", "no light source"] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
    let told = advice("camera { }\n#version 3.7;").join("\n");
    for part in ["scene:2:1: warning: `#version` is not the first", "took 1.0", "no objects"] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
    let whole =
        "#version 3.7; global_settings { assumed_gamma 1 } camera { } light_source { 0, 1 } plane { y, -1 }";
    assert_eq!(advice(whole), Vec::<String>::new());
}

#[test]
fn many_warnings_of_a_kind_are_counted() {
    let text = (0..100).map(|i| format!("#declare A{i} = {i} / 0;\n")).collect::<String>();
    let done = from_text("scene", &text, &Options::default());
    assert_eq!(done.count(Severity::Warning), 11);
    assert_eq!(done.diagnostics[10].message, "90 more warnings of this kind: division by zero");
}

#[test]
fn loops_warn_as_single_expressions_do() {
    let text =
        "#declare I = -2; #while (I < 3) #declare A = 1 / I; #declare B = acos(I); #declare I = I + 1; #end";
    let done = from_text("scene", text, &Options::default());
    let told: Vec<_> = done.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(told, ["`acos` of -2 counts as that of -1", "division by zero: it gives infinity"]);
    let text = "#declare I = 2; #while (I > -3) #declare A = sqrt(I); #declare I = I - 1; #end";
    assert!(from_text("scene", text, &Options::default()).has_errors());
}
