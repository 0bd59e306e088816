//! The command line.

fn main() {
    println!("truing {}", env!("CARGO_PKG_VERSION"));
}
