//! Tests that lack a tool.

/// Says that a test is skipped for want of a tool; where `CI=true`, fails it.
pub fn skip_or_fail(lack: &str) {
    let is_strict = std::env::var("CI").is_ok_and(|value| value == "true");
    assert!(!is_strict, "{lack} (CI=true, so that nothing may be skipped)");
    eprintln!("skipped: {lack}");
}
