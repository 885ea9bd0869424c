//! Suggestions for names that are not known.

/// `; did you mean "hold"?`, or nothing when no known name is close.
pub(crate) fn did_you_mean<N: AsRef<str>>(name: &str, known: &[N]) -> String {
    let distance = |candidate: &&N| strsim::damerau_levenshtein(name, candidate.as_ref());
    match known.iter().min_by_key(distance) {
        Some(nearest) if distance(&nearest) <= 1 + nearest.as_ref().len() / 4 => {
            format!("; did you mean {:?}?", nearest.as_ref())
        }
        _ => String::new(),
    }
}
