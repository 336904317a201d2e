//! What a request must know.

use std::fmt;

/// 128 random bits, as 32 hexadecimal digits.
#[derive(Clone)]
pub struct Token(String);

impl Token {
    /// A new one, from the random numbers of the system.
    pub fn random() -> Self {
        Self(format!("{:032x}", rand::random::<u128>()))
    }

    /// The digits.
    pub fn digits(&self) -> &str {
        &self.0
    }

    /// Whether `text` is this token. Takes the same time wherever they differ.
    pub fn is(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        let differ = own.iter().zip(other).fold(0, |all, (a, b)| all | (a ^ b));
        own.len() == other.len() && differ == 0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_only_the_same_one_passes() {
        let token = Token::random();
        assert_eq!(token.digits().len(), 32);
        assert!(token.is(token.digits()) && !token.is(Token::random().digits()));
        let mut mutated = token.digits().to_owned().into_bytes();
        mutated[31] ^= 1;
        assert!(!token.is(&String::from_utf8_lossy(&mutated)));
        assert!(!token.is("") && !token.is(&token.digits()[..31]));
    }
}
