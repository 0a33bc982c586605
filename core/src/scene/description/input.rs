//! Inputs of materials and lights: a constant, or the name of a texture.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{F64Deserializer, SeqAccessDeserializer, StrDeserializer};
use serde::de::{Deserialize, Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::colour::Colour;

/// A value that is the same everywhere, or one that a texture says: written as the value itself, or as `{"texture": "name"}`.
#[derive(Clone, Debug, PartialEq)]
pub enum Input<T> {
    /// The same everywhere.
    Constant(T),
    /// Name of a texture of the scene.
    Texture(String),
}

/// A colour or a texture.
pub type ColourInput = Input<Colour>;

/// A number or a texture; of a coloured texture the mean of its channels counts.
pub type ScalarInput = Input<f64>;

impl<T> Input<T> {
    /// The constant, if it is one.
    pub fn constant(&self) -> Option<&T> {
        match self {
            Input::Constant(value) => Some(value),
            Input::Texture(_) => None,
        }
    }

    /// The name of the texture, if it is one.
    pub fn texture(&self) -> Option<&str> {
        match self {
            Input::Constant(_) => None,
            Input::Texture(name) => Some(name),
        }
    }
}

impl ColourInput {
    /// (1, 1, 1), the default of scales.
    pub fn white() -> ColourInput {
        Input::Constant(Colour::WHITE)
    }

    /// (0, 0, 0).
    pub fn black() -> ColourInput {
        Input::Constant(Colour::grey(0.0))
    }

    /// The same number in all channels.
    pub fn grey(value: f64) -> ColourInput {
        Input::Constant(Colour::grey(value))
    }

    /// Whether this is the constant (1, 1, 1).
    pub fn is_white(&self) -> bool {
        self.constant().is_some_and(Colour::is_white)
    }

    /// Whether this is the constant (0, 0, 0).
    pub fn is_black(&self) -> bool {
        self.constant().is_some_and(Colour::is_black)
    }
}

impl ScalarInput {
    /// 0.
    pub fn zero() -> ScalarInput {
        Input::Constant(0.0)
    }

    /// 1.
    pub fn one() -> ScalarInput {
        Input::Constant(1.0)
    }

    /// Whether this is the constant 0.
    pub fn is_zero(&self) -> bool {
        self.constant() == Some(&0.0)
    }

    /// Whether this is the constant 1.
    pub fn is_one(&self) -> bool {
        self.constant() == Some(&1.0)
    }
}

impl<T> From<T> for Input<T> {
    fn from(value: T) -> Input<T> {
        Input::Constant(value)
    }
}

impl<T: Serialize> Serialize for Input<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Input::Constant(value) => value.serialize(serializer),
            Input::Texture(name) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("texture", name)?;
                map.end()
            }
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Input<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Input<T>, D::Error> {
        struct Either<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = Input<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value or {\"texture\": name}")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Input<T>, E> {
                let number: F64Deserializer<E> = value.into_deserializer();
                T::deserialize(number).map(Input::Constant)
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Input<T>, E> {
                self.visit_f64(value as f64)
            }

            fn visit_u64<E: Error>(self, value: u64) -> Result<Input<T>, E> {
                self.visit_f64(value as f64)
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Input<T>, E> {
                // No value is a word: the value's own type says best what it is.
                let word: StrDeserializer<'_, E> = value.into_deserializer();
                T::deserialize(word).map(Input::Constant)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, access: A) -> Result<Input<T>, A::Error> {
                T::deserialize(SeqAccessDeserializer::new(access)).map(Input::Constant)
            }

            fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Input<T>, A::Error> {
                let Some(key) = access.next_key::<String>()? else { return Err(A::Error::missing_field("texture")) };
                if key != "texture" {
                    return Err(A::Error::unknown_field(&key, &["texture"]));
                }
                let name = access.next_value()?;
                if let Some(key) = access.next_key::<String>()? {
                    return Err(A::Error::unknown_field(&key, &["texture"]));
                }
                Ok(Input::Texture(name))
            }
        }
        deserializer.deserialize_any(Either(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Input<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("{}_or_texture", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let constant = generator.subschema_for::<T>();
        json_schema!({
            "description": "A constant, or the name of a texture.",
            "anyOf": [
                constant,
                { "type": "object", "properties": { "texture": { "type": "string" } }, "required": ["texture"], "additionalProperties": false }
            ]
        })
    }
}
