//! Every reason has its text.

use servo::identify::estimate::Reason;
use truing::device::link::advice;

/// All of them, by their number on the wire.
fn all() -> Vec<Reason> {
    (0u8..).map_while(|number| postcard::from_bytes(&[number]).ok()).collect()
}

#[test]
fn every_reason_has_a_text_of_its_own() {
    let reasons = all();
    assert_eq!(reasons.last(), Some(&Reason::GainsDiffer));
    for reason in &reasons {
        let text = advice(*reason);
        assert!(text.len() > 30 && text != reason.code(), "{reason:?}: {text}");
    }
}
