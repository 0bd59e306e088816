//! `cargo xtask size` runs this: the image, what it begins with while interrupts are masked, and the functions that can
//! interrupt one another, lowest priority first. Prints `function | bytes` for each, and the most that the stack can need:
//! the initialisation alone, or all the others with the frames of their interrupts.

use anyhow::{Result, bail};
use panic_paths::image::Image;
use panic_paths::stack::{Depths, EXCEPTION_FRAME};
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, init, levels @ ..] = &arguments[..] else {
        bail!("usage: stack-depth IMAGE.elf INITIALISATION FUNCTION …");
    };
    let image = Image::read(Path::new(image))?;
    let mut depths = Depths::new(&image);
    let mut told = |root: &str| -> Result<u32> {
        let depth = depths.from(root)?;
        println!("{root} | {}", depth.bytes);
        for (name, frame) in depth.chain {
            eprintln!("  {frame:6} {name}");
        }
        Ok(depth.bytes)
    };
    let init = told(init)?;
    let mut nested = 0;
    for (level, root) in levels.iter().enumerate() {
        nested += told(root)? + if level > 0 { EXCEPTION_FRAME } else { 0 };
    }
    eprintln!("{} calls by register not followed", depths.by_register.len());
    println!("most | {}", init.max(nested));
    Ok(())
}
