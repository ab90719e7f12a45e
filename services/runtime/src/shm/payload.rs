//! Messages as iceoryx2 payloads.

use iceoryx2::prelude::ZeroCopySend;
use ipc_types::Message;
use std::fmt;

/// A message as it lies in shared memory.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub(crate) struct Payload<T: Message>(pub(crate) T);

impl<T: Message> fmt::Debug for Payload<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::TOPIC)
    }
}

#[allow(unsafe_code, reason = "iceoryx2 asks for this marker")]
// SAFETY: a `Message` is `bytemuck::Pod`: `repr(C)`, without pointers, handles or padding, any bytes valid;
// its layout is checked at open through the layout attribute, so one name means one layout.
unsafe impl<T: Message> ZeroCopySend for Payload<T> {
    unsafe fn type_name() -> &'static str {
        T::TOPIC
    }
}
