//! Colours: three numbers, linear Rec.709, written as `[r, g, b]` or as one number for grey.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};

/// A colour, linear Rec.709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub [f64; 3]);

impl Colour {
    /// (1, 1, 1).
    pub const WHITE: Colour = Colour([1.0; 3]);

    /// The same number in all three channels.
    pub const fn grey(value: f64) -> Colour {
        Colour([value; 3])
    }

    /// Whether this is (1, 1, 1): a scale that changes nothing.
    pub fn is_white(&self) -> bool {
        *self == Colour::WHITE
    }

    /// (1, 1, 1), the default of scales.
    pub fn white() -> Colour {
        Colour::WHITE
    }

    /// Whether every channel is zero.
    pub fn is_black(&self) -> bool {
        self.0 == [0.0; 3]
    }

    /// The channels in single precision, as transport uses them.
    pub fn to_f32(self) -> [f32; 3] {
        self.0.map(|channel| channel as f32)
    }
}

impl Serialize for Colour {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [r, g, b] = self.0;
        if r == g && g == b { serializer.serialize_f64(r) } else { self.0.serialize(serializer) }
    }
}

impl<'de> Deserialize<'de> for Colour {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Colour, D::Error> {
        struct Channels;
        impl<'de> Visitor<'de> for Channels {
            type Value = Colour;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or [r, g, b]")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Colour, E> {
                Ok(Colour::grey(value))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Colour, E> {
                Ok(Colour::grey(value as f64))
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Colour, E> {
                Ok(Colour::grey(value as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<Colour, A::Error> {
                let mut channels = [0.0; 3];
                for (have, channel) in channels.iter_mut().enumerate() {
                    *channel = access.next_element()?.ok_or_else(|| A::Error::invalid_length(have, &self))?;
                }
                if access.next_element::<f64>()?.is_some() {
                    return Err(A::Error::invalid_length(4, &self));
                }
                Ok(Colour(channels))
            }
        }
        deserializer.deserialize_any(Channels)
    }
}

impl JsonSchema for Colour {
    fn schema_name() -> Cow<'static, str> {
        "Colour".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A colour in linear Rec.709: [r, g, b], or one number for grey.",
            "oneOf": [
                { "type": "number" },
                { "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 }
            ]
        })
    }
}
