//! What a message is.

use crate::encode::Writer;
use crate::reader::{Reader, TooShort};

/// Something that is read from the front of a payload; a tail that it does not know is ignored.
pub trait Layout<'a>: Sized {
    /// Reads it.
    ///
    /// # Errors
    /// The payload ends before the part that every firmware sends.
    fn read(reader: &mut Reader<'a>) -> Result<Self, TooShort>;
}

/// Nothing: the acknowledgement of a command.
impl Layout<'_> for () {
    fn read(_: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(())
    }
}

/// A request to the controller: a new one is one type that implements this.
pub trait Request {
    /// Message code.
    const CODE: u16;
    /// What the controller answers.
    type Reply<'a>: Layout<'a>;
    /// Writes what the request carries; most carry nothing.
    fn write(&self, _payload: &mut Writer<'_>) {}
}

/// Reads the answer to `request`.
///
/// # Errors
/// The payload is shorter than any firmware sends.
pub fn parse_reply<'a, R: Request>(_request: &R, payload: &'a [u8]) -> Result<R::Reply<'a>, TooShort> {
    R::Reply::read(&mut Reader::new(payload))
}
