//! A statement and the values bound to it, in order.

use std::borrow::Cow;

/// A statement. Its text is part of the program; what comes from outside is only ever bound.
pub(in crate::store) struct Statement {
    pub(super) text: Cow<'static, str>,
    pub(super) values: Vec<Value>,
}

/// A value, or the absence of one of this type.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::store) enum Value {
    Integer(Option<i64>),
    Real(Option<f64>),
    Text(Option<String>),
    Bytes(Option<Vec<u8>>),
}

impl Statement {
    /// A statement without values yet.
    pub(in crate::store) fn new(text: &'static str) -> Self {
        Self { text: Cow::Borrowed(text), values: Vec::new() }
    }

    /// A statement made of names that a database's own catalogue gave, and of nothing from outside.
    pub(in crate::store) fn of_names(text: String) -> Self {
        Self { text: Cow::Owned(text), values: Vec::new() }
    }

    fn bind(mut self, value: Value) -> Self {
        self.values.push(value);
        self
    }

    /// Binds a whole number.
    pub(in crate::store) fn integer(self, value: impl Into<i64>) -> Self {
        self.bind(Value::Integer(Some(value.into())))
    }

    /// Binds a whole number, or nothing.
    pub(in crate::store) fn integer_if(self, value: Option<impl Into<i64>>) -> Self {
        self.bind(Value::Integer(value.map(Into::into)))
    }

    /// Binds a count. No count of ours reaches 2⁶³.
    pub(in crate::store) fn count(self, value: u64) -> Self {
        self.bind(Value::Integer(Some(value as i64)))
    }

    /// Binds a number.
    pub(in crate::store) fn real(self, value: f64) -> Self {
        self.bind(Value::Real(Some(value)))
    }

    /// Binds a number, or nothing.
    pub(in crate::store) fn real_if(self, value: Option<f64>) -> Self {
        self.bind(Value::Real(value))
    }

    /// Binds a text.
    pub(in crate::store) fn text(self, value: &str) -> Self {
        self.text_if(Some(value))
    }

    /// Binds a text, or nothing. PostgreSQL knows no zero in a text; where one gets this far, as in what a worker says went wrong, it
    /// shows as a replacement character.
    pub(in crate::store) fn text_if(self, value: Option<&str>) -> Self {
        self.bind(Value::Text(value.map(|text| text.replace('\0', "\u{fffd}"))))
    }

    /// Binds whatever a row held.
    pub(in crate::store) fn value(self, value: Value) -> Self {
        self.bind(value)
    }

    /// Binds bytes.
    pub(in crate::store) fn bytes(self, value: &[u8]) -> Self {
        self.bind(Value::Bytes(Some(value.to_vec())))
    }
}
