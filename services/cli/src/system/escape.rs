//! Names of robots as names of instances, as `systemd-escape` does it.

use core::fmt::Write as _;

/// The instance of this name.
pub fn instance(name: &str) -> String {
    let mut escaped = String::new();
    for (index, byte) in name.bytes().enumerate() {
        let is_plain =
            byte.is_ascii_alphanumeric() || matches!(byte, b':' | b'_') || (byte == b'.' && index > 0);
        // Writing to a string can't fail.
        let _ = match byte {
            b'/' => escaped.write_char('-'),
            _ if is_plain => escaped.write_char(char::from(byte)),
            _ => write!(escaped, "\\x{byte:02x}"),
        };
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_as_systemd_does_it() {
        // systemd-escape 'A' 'left one' 'a/b-c' '.hidden' 'é'
        let names = ["A", "left one", "a/b-c", ".hidden", "é"].map(instance);
        assert_eq!(names, ["A", "left\\x20one", "a-b\\x2dc", "\\x2ehidden", "\\xc3\\xa9"]);
    }
}
