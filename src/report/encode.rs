//! Arrays as base64 text of little-endian numbers.

use serde_json::Value;

const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

pub(super) fn base64(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

pub(super) fn encode_f32(values: impl IntoIterator<Item = f64>) -> Value {
    base64(&values.into_iter().flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>()).into()
}

pub(super) fn encode_u32(values: impl IntoIterator<Item = usize>) -> Value {
    let narrow = |index: usize| u32::try_from(index).expect("fewer points than 2^32").to_le_bytes();
    base64(&values.into_iter().flat_map(narrow).collect::<Vec<u8>>()).into()
}

#[cfg(test)]
mod tests {
    use crate::report::encode::base64;

    /// Truth: the examples of RFC 4648, section 10.
    #[test]
    fn base64_of_the_standard() {
        let all = ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|text| base64(text.as_bytes()));
        assert_eq!(all, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]);
    }
}
