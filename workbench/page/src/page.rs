//! What the engine asks of the page, and tells it while it works.

use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen(raw_module = "./told.js")]
unsafe extern "C" {
    /// The effects found so far; an empty text: one more candidate was tried.
    pub fn progress(text: &str);
    /// The engine cannot go on: a defect of its own.
    fn broken(text: &str);
    /// Time since any moment, ms.
    pub fn now() -> f64;
}

/// Before anything else: a panic is told as a sentence, not as a trap.
#[wasm_bindgen(start)]
fn begin() {
    std::panic::set_hook(Box::new(|panic| broken(&panic.to_string())));
}
