//! Skips of tests are counted by `cargo xtask test`, each under the name of its test.

use std::process::Command;
use trials::measured::skip;

/// Set for the child process alone.
const CHILD: &str = "TRUING_SKIPS_ON_PURPOSE";

#[test]
fn a_skip_is_logged_under_the_name_of_its_test() {
    if std::env::var_os(CHILD).is_some() {
        return skip("on purpose");
    }
    let log = tempfile::NamedTempFile::new().expect("a file");
    let this = "skips::a_skip_is_logged_under_the_name_of_its_test";
    let child = Command::new(std::env::current_exe().expect("this binary"))
        .args([this, "--exact", "--test-threads=2"])
        .env(CHILD, "1")
        .env("TRUING_SKIP_LOG", log.path())
        .output()
        .expect("the child runs");
    assert!(child.status.success(), "{child:?}");
    let text = std::fs::read_to_string(log.path()).expect("the log");
    let (test, reason) = text.trim_end().split_once('\t').expect("test and reason");
    assert!(test.ends_with(this), "{text}");
    assert_eq!(reason, "on purpose");
}
