//! Number types of data sets and attributes.
use hdf5::Datatype;
use hdf5::types::{FloatSize, IntSize, TypeDescriptor};

/// The number types that a data set or an attribute can hold. All are little-endian in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned, 1 byte.
    U8,
    /// Signed, 4 bytes.
    I32,
    /// Unsigned, 4 bytes.
    U32,
    /// Signed, 8 bytes.
    I64,
    /// Unsigned, 8 bytes.
    U64,
    /// IEEE 754, 4 bytes.
    F32,
    /// IEEE 754, 8 bytes.
    F64,
}

impl Kind {
    const ALL: [Self; 7] = [Self::U8, Self::I32, Self::U32, Self::I64, Self::U64, Self::F32, Self::F64];

    /// Bytes of one number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The library's type, in the file and, on a little-endian machine, in memory.
    pub(super) fn library_type(self) -> hdf5::Result<Datatype> {
        Datatype::from_descriptor(&match self {
            Self::U8 => TypeDescriptor::Unsigned(IntSize::U1),
            Self::I32 => TypeDescriptor::Integer(IntSize::U4),
            Self::U32 => TypeDescriptor::Unsigned(IntSize::U4),
            Self::I64 => TypeDescriptor::Integer(IntSize::U8),
            Self::U64 => TypeDescriptor::Unsigned(IntSize::U8),
            Self::F32 => TypeDescriptor::Float(FloatSize::U4),
            Self::F64 => TypeDescriptor::Float(FloatSize::U8),
        })
    }

    /// The kind of a type of a file; `None` for any type that this program does not write.
    pub(super) fn of_type(of_file: &Datatype) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.library_type().is_ok_and(|own| own == *of_file))
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let kind = match self {
            Self::U8 | Self::U32 | Self::U64 => "unsigned integers",
            Self::I32 | Self::I64 => "integers",
            Self::F32 | Self::F64 => "real numbers",
        };
        write!(f, "{kind} of {} bytes", self.bytes())
    }
}

/// A number type that a data set or an attribute can hold.
pub trait Element: bytemuck::Pod + hdf5::H5Type {
    /// The type.
    const KIND: Kind;
}

macro_rules! element {
    ($($type:ty, $kind:ident;)*) => {$(
        impl Element for $type {
            const KIND: Kind = Kind::$kind;
        }
    )*};
}
element! {
    u8, U8;
    i32, I32;
    u32, U32;
    i64, I64;
    u64, U64;
    f32, F32;
    f64, F64;
}
