//! The `octray` program.
fn main() {}
