//! Number types of data sets and attributes.
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5t::{
    H5T_IEEE_F32LE, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT, H5T_NATIVE_INT32, H5T_NATIVE_INT64,
    H5T_NATIVE_UINT8, H5T_NATIVE_UINT32, H5T_NATIVE_UINT64, H5T_STD_I32LE, H5T_STD_I64LE, H5T_STD_U8LE,
    H5T_STD_U32LE, H5T_STD_U64LE,
};

/// A number type that a data set or an attribute can hold.
pub trait Element: bytemuck::Pod {
    /// HDF5 type in memory.
    #[doc(hidden)]
    fn memory_type() -> hid_t;
    /// HDF5 type in the file: little-endian on every machine.
    #[doc(hidden)]
    fn file_type() -> hid_t;
}

macro_rules! element {
    ($($type:ty, $memory:ident, $file:ident;)*) => {$(
        impl Element for $type {
            fn memory_type() -> hid_t { *$memory }
            fn file_type() -> hid_t { *$file }
        }
    )*};
}
element! {
    u8, H5T_NATIVE_UINT8, H5T_STD_U8LE;
    i32, H5T_NATIVE_INT32, H5T_STD_I32LE;
    u32, H5T_NATIVE_UINT32, H5T_STD_U32LE;
    i64, H5T_NATIVE_INT64, H5T_STD_I64LE;
    u64, H5T_NATIVE_UINT64, H5T_STD_U64LE;
    f32, H5T_NATIVE_FLOAT, H5T_IEEE_F32LE;
    f64, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE;
}
