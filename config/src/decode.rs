//! From a document to a value, by serde. Every error carries the key's path and its place.

use crate::document::{Node, Value};
use crate::error::KeyError;
use crate::nearest::did_you_mean;
use crate::origin::Origin;
use core::fmt;
use serde::de::{
    self, Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error as _, Expected, IntoDeserializer,
    MapAccess, SeqAccess, Unexpected, VariantAccess, Visitor, value::StrDeserializer,
};
use serde::forward_to_deserialize_any;
use std::collections::btree_map;
use std::slice;

/// Decodes a whole document.
pub(crate) fn decode<'de, T: Deserialize<'de>>(document: &'de Node) -> Result<T, KeyError> {
    T::deserialize(document).map_err(|mut error| {
        error.path.reverse();
        KeyError {
            origin: error.origin.unwrap_or_else(|| document.origin.clone()),
            key: error.path.join("."),
            problem: error.problem,
        }
    })
}

/// An error on its way from the value to the root.
#[derive(Debug)]
pub(crate) struct DecodeError {
    problem: String,
    /// Where the innermost value was written.
    origin: Option<Origin>,
    /// Segments of the key's path, innermost first.
    path: Vec<String>,
}

impl DecodeError {
    fn new(problem: String) -> Self {
        Self { problem, origin: None, path: Vec::new() }
    }

    fn below(mut self, segment: impl Into<String>, origin: &Origin) -> Self {
        self.path.push(segment.into());
        self.at(origin)
    }

    fn at(mut self, origin: &Origin) -> Self {
        self.origin.get_or_insert_with(|| origin.clone());
        self
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problem)
    }
}

impl std::error::Error for DecodeError {}

impl de::Error for DecodeError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let found = match found {
            Unexpected::Str(text) => format!("{text:?}"),
            Unexpected::Signed(number) => number.to_string(),
            Unexpected::Unsigned(number) => number.to_string(),
            Unexpected::Float(number) => number.to_string(),
            Unexpected::Bool(truth) => truth.to_string(),
            Unexpected::Seq => "an array".to_owned(),
            Unexpected::Map => "a table".to_owned(),
            other => other.to_string(),
        };
        Self::new(format!("found {found}, expected {}", in_words(&expected.to_string())))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        Self::new(format!("found an array of length {length}, expected {}", in_words(&expected.to_string())))
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        let names = expected.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        let hint = did_you_mean(variant, expected);
        Self::new(format!("found {variant:?}, expected one of {names}{hint}"))
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        let hint = did_you_mean(field, expected);
        let known = if hint.is_empty() { format!(", expected one of {}", expected.join(", ")) } else { hint };
        Self::new(format!("unknown key{known}"))
    }

    fn missing_field(field: &'static str) -> Self {
        let mut error = Self::new("found nothing, expected a value".to_owned());
        error.path.push(field.to_owned());
        error
    }
}

/// Serde speaks of Rust's types; people who write TOML do not.
fn in_words(expected: &str) -> &str {
    match expected {
        "f64" => "a finite number",
        "u64" | "usize" => "a whole number from 0",
        "u8" => "a whole number from 0 to 255",
        "a sequence" => "an array",
        "a map" => "a table",
        other => other,
    }
}

impl<'de> Deserializer<'de> for &'de Node {
    type Error = DecodeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        match &self.value {
            Value::String(text) => visitor.visit_borrowed_str(text),
            Value::Integer(number) => match (i64::try_from(*number), u64::try_from(*number)) {
                (Ok(number), _) => visitor.visit_i64(number),
                (_, Ok(number)) => visitor.visit_u64(number),
                _ => Err(DecodeError::invalid_type(Unexpected::Other(&number.to_string()), &visitor)),
            },
            Value::Float(number) if number.is_finite() => visitor.visit_f64(*number),
            Value::Float(number) => Err(DecodeError::invalid_type(Unexpected::Float(*number), &visitor)),
            Value::Boolean(truth) => visitor.visit_bool(*truth),
            Value::Datetime(_) => {
                Err(DecodeError::invalid_type(Unexpected::Other(&self.value.describe()), &visitor))
            }
            Value::Array(elements) => {
                let mut rest = Elements { elements: elements.iter(), next: 0 };
                let value = visitor.visit_seq(&mut rest)?;
                let wanted = rest.next;
                match rest.elements.len() {
                    0 => Ok(value),
                    _ => Err(DecodeError::new(format!(
                        "found an array of length {}, expected an array of length {wanted}",
                        elements.len(),
                    ))),
                }
            }
            Value::Table(table) => visitor.visit_map(Entries { entries: table.iter(), value: None }),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DecodeError> {
        visitor.visit_some(self) // TOML has no null: what is absent is not in the document
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        match &self.value {
            Value::Table(_) => self.deserialize_any(visitor),
            // Serde would take an array for the fields in order.
            other => Err(DecodeError::new(format!("found {}, expected a table", other.describe()))),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        match &self.value {
            Value::String(variant) => visitor.visit_enum(Variant { name: variant, content: None }),
            Value::Table(table) if table.len() == 1 => {
                let (name, content) = table.iter().next().expect("it has one entry");
                visitor.visit_enum(Variant { name, content: Some(content) })
            }
            other => Err(DecodeError::new(format!(
                "found {}, expected one of {}",
                other.describe(),
                variants.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
            ))),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq
        tuple tuple_struct map identifier ignored_any
    }
}

struct Elements<'de> {
    elements: slice::Iter<'de, Node>,
    next: usize,
}

impl<'de> SeqAccess<'de> for &mut Elements<'de> {
    type Error = DecodeError;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, DecodeError> {
        let Some(element) = self.elements.next() else { return Ok(None) };
        let index = self.next;
        self.next += 1;
        seed.deserialize(element).map(Some).map_err(|error| error.below(index.to_string(), &element.origin))
    }
}

struct Entries<'de> {
    entries: btree_map::Iter<'de, String, Node>,
    value: Option<(&'de String, &'de Node)>,
}

impl<'de> MapAccess<'de> for Entries<'de> {
    type Error = DecodeError;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, DecodeError> {
        self.value = self.entries.next();
        let Some((key, node)) = self.value else { return Ok(None) };
        let name: StrDeserializer<'_, DecodeError> = key.as_str().into_deserializer();
        seed.deserialize(name).map(Some).map_err(|error| error.below(key, &node.origin))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, DecodeError> {
        let (key, node) = self.value.take().expect("serde asks for a value after its key");
        seed.deserialize(node).map_err(|error| error.below(key, &node.origin))
    }
}

/// `"name"`, or `{ name = content }`.
struct Variant<'de> {
    name: &'de str,
    content: Option<&'de Node>,
}

impl<'de> EnumAccess<'de> for Variant<'de> {
    type Error = DecodeError;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), DecodeError> {
        let name: StrDeserializer<'_, DecodeError> = self.name.into_deserializer();
        match seed.deserialize(name) {
            Ok(variant) => Ok((variant, self)),
            Err(error) => Err(match self.content {
                Some(node) => error.at(&node.origin),
                None => error,
            }),
        }
    }
}

impl<'de> Variant<'de> {
    fn content(&self) -> Result<&'de Node, DecodeError> {
        let name = self.name;
        self.content
            .ok_or_else(|| DecodeError::new(format!("found {name:?} alone, expected {{ {name} = a value }}")))
    }

    fn inside(&self, error: DecodeError) -> DecodeError {
        match self.content {
            Some(node) => error.below(self.name, &node.origin),
            None => error,
        }
    }
}

impl<'de> VariantAccess<'de> for Variant<'de> {
    type Error = DecodeError;

    fn unit_variant(self) -> Result<(), DecodeError> {
        match self.content {
            None => Ok(()),
            Some(_) => {
                let problem = format!("found a value, expected just {:?}", self.name);
                Err(self.inside(DecodeError::new(problem)))
            }
        }
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, DecodeError> {
        seed.deserialize(self.content()?).map_err(|error| self.inside(error))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, DecodeError> {
        self.content()?.deserialize_any(visitor).map_err(|error| self.inside(error))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DecodeError> {
        self.content()?.deserialize_any(visitor).map_err(|error| self.inside(error))
    }
}
