//! A channel of the log, and the schema of what it carries.

use core::marker::PhantomData;
use foxglove::{Encode, Schema};
use mikoshi_observation::{ChannelSchema, LogWriter, WriteLogError};

/// A topic that carries messages of one schema.
pub struct Topic<M> {
    channel: u16,
    messages: PhantomData<fn(M)>,
}

impl<M: Encode> Topic<M> {
    /// Makes it known to the readers of a log.
    pub fn add(log: &mut LogWriter, name: &str) -> Result<Self, WriteLogError> {
        let Schema { name: schema, encoding, data } =
            M::get_schema().unwrap_or_else(|| Schema::new("", "", &[][..]));
        let schema = ChannelSchema {
            name: &schema,
            encoding: &encoding,
            data: &data,
            message_encoding: &M::get_message_encoding(),
        };
        Ok(Self { channel: log.add_channel(name, &schema)?, messages: PhantomData })
    }

    /// Says something of a tick.
    pub fn write(&self, log: &mut LogWriter, tick: u64, message: &M) -> Result<(), WriteLogError> {
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or_default());
        // A vector has room for any message.
        let _ = message.encode(&mut bytes);
        log.write_beside(self.channel, tick, &bytes)
    }
}
