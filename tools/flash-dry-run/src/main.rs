//! `cargo xtask flash --dry-run` runs this on the image that it has built.

use boards::DEFAULT;
use flash_dry_run::check;
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(image) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!(
            "error: no image given: type `cargo xtask flash --dry-run`, which builds one and checks it"
        );
        return ExitCode::from(2);
    };
    let chip = DEFAULT.chip;
    match check(&image, chip) {
        Ok(found) => {
            println!("{found}\nfits {}; nothing was programmed", chip.probe);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
