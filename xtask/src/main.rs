//! `cargo xtask …`

fn main() {
    println!("xtask");
}
