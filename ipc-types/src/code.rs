//! Enumerations travel as bytes; a reader turns them back and refuses what it does not know.

/// Defines an enumeration with a byte code and its checked inverse.
macro_rules! codes {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $( $(#[$vmeta:meta])* $variant:ident = $code:literal => $word:literal, )* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum $name { $( $(#[$vmeta])* $variant = $code, )* }

        impl $name {
            /// Every value, in the order of the codes.
            pub const ALL: &'static [Self] = &[ $( Self::$variant, )* ];
            /// The byte that stands for this in a message.
            #[must_use]
            pub const fn code(self) -> u8 { self as u8 }
            /// The inverse of [`Self::code`]; `None` for a byte that no version of this build writes.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code { $( $code => Some(Self::$variant), )* _ => None }
            }
            /// A word for people and logs.
            #[must_use]
            pub const fn word(self) -> &'static str {
                match self { $( Self::$variant => $word, )* }
            }
        }
        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result { f.write_str(self.word()) }
        }
    };
}
pub(crate) use codes;
