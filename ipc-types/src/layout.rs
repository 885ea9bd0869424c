//! What makes a struct a payload: its name, its layout, and who may read it.

use bytemuck::Pod;

/// Who may subscribe to a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// Services and observers.
    Everyone,
    /// Observers only: ground truth and diagnostics, which control must not see.
    Observers,
}

/// What a payload is made of: nothing else travels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `f64`; receivers check that it is finite.
    Float,
    /// `u64`: counts, ticks, flags and modes.
    Integer,
}

/// A type that fields may have. Implemented for `f64`, `u64` and arrays of them: an invalid `bool` or
/// enum would be undefined behaviour before any check.
pub trait WireType: Pod {
    /// What it consists of.
    const SCALAR: Scalar;
}

impl WireType for f64 {
    const SCALAR: Scalar = Scalar::Float;
}

impl WireType for u64 {
    const SCALAR: Scalar = Scalar::Integer;
}

impl<T: WireType, const N: usize> WireType for [T; N]
where
    [T; N]: Pod,
{
    const SCALAR: Scalar = T::SCALAR;
}

/// One field of a payload, for those who name a differing byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The field's name, which ends in its unit.
    pub name: &'static str,
    /// What it consists of.
    pub scalar: Scalar,
    /// Offset from the payload's start.
    pub offset_bytes: usize,
    /// Size in the payload.
    pub size_bytes: usize,
}

/// A plain value that travels in a [`Frame`](crate::Frame).
///
/// Implemented by the `payload!` macro only, which derives [`Pod`]: no padding, any bit pattern valid.
pub trait Payload: Pod + PartialEq + core::fmt::Debug + Send + Sync {
    /// The name under which the payload is published, for one robot or for the team.
    const NAME: &'static str;
    /// The payload's definition as text: what its schema hash is made of.
    const DEFINITION: &'static str;
    /// The payload's fields, in order.
    const FIELDS: &'static [Field];
    /// Who may read it.
    const AUDIENCE: Audience;
    /// Hash of the definition and of the layout: two builds exchange frames only if it agrees.
    const SCHEMA_HASH: u64 = schema_hash(Self::NAME, Self::DEFINITION, Self::FIELDS);
    /// Type name on the wire; it carries the schema hash, since iceoryx2 rejects another size but
    /// would accept another layout under the same name.
    const TYPE_NAME: &'static str;

    /// The field that holds the byte at `offset_bytes`.
    fn field_at(offset_bytes: usize) -> Option<&'static Field> {
        Self::FIELDS
            .iter()
            .find(|field| (field.offset_bytes..field.offset_bytes + field.size_bytes).contains(&offset_bytes))
    }

    /// The first field that holds a NaN or an infinity.
    fn first_non_finite(&self) -> Option<&'static Field> {
        const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
        const EXPONENT_ONE: u64 = 0x0010_0000_0000_0000;
        const SIGN: u64 = 1 << 63;
        let words: &[u64] = bytemuck::cast_slice(bytemuck::bytes_of(self));
        // In one pass over all: an exponent of ones, to which one is added, carries into the sign's place. An integer may
        // do so, too: then fields are looked at.
        let carries = words.iter().fold(0, |carries, word| carries | ((word & EXPONENT) + EXPONENT_ONE));
        if carries & SIGN == 0 {
            return None;
        }
        Self::FIELDS.iter().filter(|field| field.scalar == Scalar::Float).find(|field| {
            let start = field.offset_bytes / size_of::<f64>();
            let words = words.get(start..start + field.size_bytes / size_of::<f64>()).unwrap_or_default();
            // No early exit, so that it vectorises: all values are finite in all frames but the last.
            words.iter().fold(false, |found, word| found | (word & EXPONENT == EXPONENT))
        })
    }
}

/// A payload that services may subscribe to. Ground truth does not implement it, so that a service
/// which reads ground truth does not compile.
pub trait ServicePayload: Payload {}

/// FNV-1a over name, definition, and offset and size of every field. The latter two tell layouts apart
/// whose definition reads the same, such as `[f64; MAX_JOINTS]` under another limit.
pub const fn schema_hash(name: &str, definition: &str, fields: &[Field]) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    let mut hash = fnv1a(fnv1a(OFFSET, name.as_bytes()), definition.as_bytes());
    let mut i = 0;
    while i < fields.len() {
        hash = fnv1a(hash, &(fields[i].offset_bytes as u64).to_le_bytes());
        hash = fnv1a(hash, &(fields[i].size_bytes as u64).to_le_bytes());
        i += 1;
    }
    hash
}

const fn fnv1a(mut hash: u64, bytes: &[u8]) -> u64 {
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(PRIME);
        i += 1;
    }
    hash
}

/// Longest type name: payload name, a colon and sixteen hexadecimal digits.
pub(crate) const TYPE_NAME_CAPACITY: usize = 64;

/// `NAME:0123456789abcdef`, at compile time.
pub(crate) const fn type_name_bytes(name: &str, hash: u64) -> ([u8; TYPE_NAME_CAPACITY], usize) {
    let mut bytes = [0; TYPE_NAME_CAPACITY];
    let name = name.as_bytes();
    let mut length = 0;
    while length < name.len() {
        bytes[length] = name[length];
        length += 1;
    }
    bytes[length] = b':';
    length += 1;
    let mut digit = 0;
    while digit < 16 {
        let nibble = (hash >> (60 - 4 * digit)) as u8 & 0xf;
        bytes[length] = if nibble < 10 { b'0' + nibble } else { b'a' + nibble - 10 };
        length += 1;
        digit += 1;
    }
    (bytes, length)
}

/// Defines a payload: the struct, its layout as data, and its wire name.
macro_rules! payload {
    (@audience Everyone $name:ident) => { impl $crate::ServicePayload for $name {} };
    (@audience Observers $name:ident) => {};
    (
        $(#[$meta:meta])*
        $audience:ident $wire_name:literal
        pub struct $name:ident { $( $(#[$field_meta:meta])* pub $field:ident : $type:ty ),* $(,)? }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $( $(#[$field_meta])* pub $field: $type ),* }

        impl $crate::Payload for $name {
            const NAME: &'static str = $wire_name;
            const DEFINITION: &'static str = concat!($( stringify!($field), ":", stringify!($type), ";" ),*);
            const FIELDS: &'static [$crate::Field] = &[$( $crate::Field {
                name: stringify!($field),
                scalar: <$type as $crate::WireType>::SCALAR,
                offset_bytes: core::mem::offset_of!($name, $field),
                size_bytes: size_of::<$type>(),
            } ),*];
            const AUDIENCE: $crate::Audience = $crate::Audience::$audience;
            const TYPE_NAME: &'static str = {
                const NAMED: ([u8; $crate::layout::TYPE_NAME_CAPACITY], usize) =
                    $crate::layout::type_name_bytes($wire_name, <$name as $crate::Payload>::SCHEMA_HASH);
                match core::str::from_utf8(NAMED.0.split_at(NAMED.1).0) {
                    Ok(name) => name,
                    Err(_) => panic!("wire names are ASCII"),
                }
            };
        }

        const _: () = assert!(
            size_of::<$crate::Frame<$name>>() == size_of::<$crate::Envelope>() + size_of::<$name>()
                && core::mem::offset_of!($crate::Frame<$name>, payload) == size_of::<$crate::Envelope>(),
            "a frame is its envelope and its payload, without padding"
        );

        $crate::layout::payload!(@audience $audience $name);
    };
}
pub(crate) use payload;
