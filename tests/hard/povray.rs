//! POV-Ray on the same cases, when the table is written and it is installed.

use super::table::is_written;
use super::{HEIGHT, WIDTH};
use glam::DVec3;
use octray::film::Film;
use octray::image_io::{self, Assume};
use octray::transfer::Transfer;
use std::fmt::Write;
use std::process::{Command, Stdio};

/// Runs a scene; true if POV-Ray made the picture `out.png`.
fn run(folder: &std::path::Path, text: &str) -> Option<bool> {
    std::fs::write(folder.join("scene.pov"), text).ok()?;
    let mut command = Command::new("povray");
    command.current_dir(folder).stdin(Stdio::null());
    command.args(["+Iscene.pov", "+Oout.png", "+FN16", "File_Gamma=1.0", "-A", "-D", "+WT1"]);
    command.args([format!("+W{WIDTH}"), format!("+H{HEIGHT}")]);
    Some(command.output().ok()?.status.success())
}

/// POV-Ray's picture in linear light; `None` if it is not asked or gives none.
pub fn picture(text: &str) -> Option<Film> {
    if !is_written() {
        return None;
    }
    let folder = tempfile::tempdir().ok()?;
    run(folder.path(), text)?;
    image_io::read(&folder.path().join("out.png"), Assume::Transfer(Transfer::LINEAR)).ok()
}

/// Whether POV-Ray takes the scene.
pub fn takes(text: &str) -> Option<bool> {
    if !is_written() {
        return None;
    }
    let folder = tempfile::tempdir().ok()?;
    run(folder.path(), text)
}

/// How far along each ray POV-Ray's `trace` meets `object`; `None` for a miss.
pub fn trace(object: &str, rays: &[(DVec3, DVec3)]) -> Option<Vec<Option<f64>>> {
    if !is_written() {
        return None;
    }
    let folder = tempfile::tempdir().ok()?;
    let mut text = format!(
        "#version 3.7;\n#declare S = {object};\n#fopen F \"out.txt\" write\n#macro T(P, D)\n#declare N = <0,0,0>;\n\
         #declare H = trace(S, P, D, N);\n#if (vlength(N) = 0) #write (F, \"- \\n\") #else #write (F, str(vlength(H - P), 0, 17), \"\\n\") #end\n#end\n"
    );
    for (o, d) in rays {
        let v = |v: &DVec3| format!("<{:e},{:e},{:e}>", v.x, v.y, v.z);
        let _ = writeln!(text, "T({}, {})", v(o), v(d));
    }
    run(folder.path(), &text)?;
    let said = std::fs::read_to_string(folder.path().join("out.txt")).ok()?;
    let found: Vec<_> = said.lines().map(|line| line.trim().parse().ok()).collect();
    (found.len() == rays.len()).then_some(found)
}
