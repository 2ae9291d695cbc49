//! What somebody who misspelt a name may have meant.

/// A question behind a name that is not there: the nearest of those that are, if one is near.
/// Names that differ in more than a third of their letters are not near.
pub fn did_you_mean<'a>(
    name: &str,
    present: impl IntoIterator<Item = &'a (impl AsRef<str> + ?Sized + 'a)>,
) -> String {
    let lower = name.to_lowercase();
    let distance = |other: &str| strsim::damerau_levenshtein(&lower, &other.to_lowercase());
    let others = present.into_iter().map(AsRef::as_ref).filter(|other| *other != name);
    let near = others.map(|other| (distance(other), other)).min();
    let bound = (name.chars().count() / 3).max(1);
    match near {
        Some((distance, near)) if distance <= bound => format!("; did you mean `{near}`?"),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_asked_for_and_others_are_not() {
        let present = ["x", "y", "label", "intensity", "/points"];
        assert_eq!(did_you_mean("lable", &present), "; did you mean `label`?");
        assert_eq!(did_you_mean("Intensity", &present), "; did you mean `intensity`?");
        assert_eq!(did_you_mean("/point", &present), "; did you mean `/points`?");
        assert_eq!(did_you_mean("semantic", &present), "");
        assert_eq!(did_you_mean("label", &present), "");
        assert_eq!(did_you_mean("label", &[] as &[&str]), "");
    }
}
