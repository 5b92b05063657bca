//! Attributes: short arrays of numbers and texts attached to groups and data sets.
use hdf5_sys::h5::hsize_t;
use hdf5_sys::h5a::{
    H5Aclose, H5Acreate2, H5Aexists_by_name, H5Aget_space, H5Aget_type, H5Aopen_by_name, H5Aread, H5Awrite,
};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5o::{H5Oclose, H5Oopen};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::{H5S_SCALAR, H5Sclose, H5Screate, H5Screate_simple, H5Sget_simple_extent_npoints};
use hdf5_sys::h5t::{
    H5T_C_S1, H5T_STR_NULLPAD, H5T_STRING, H5Tclose, H5Tcopy, H5Tget_class, H5Tget_size, H5Tis_variable_str,
    H5Tset_size, H5Tset_strpad,
};

use super::{Element, FileError, Handle, ParallelFile, c_text, library_error};

impl ParallelFile {
    /// Not collective. True when the object has that attribute.
    pub fn has_attribute(&self, object: &str, name: &str) -> bool {
        let (object, name) = (c_text(object), c_text(name));
        // SAFETY: open file, terminated names.
        unsafe { H5Aexists_by_name(self.id(), object.as_ptr(), name.as_ptr(), H5P_DEFAULT) > 0 }
    }

    /// Attaches an array to an object; one value makes an array of length one.
    pub fn set_attribute<T: Element>(&self, object: &str, name: &str, values: &[T]) -> Result<(), FileError> {
        let dims = [values.len() as hsize_t];
        // SAFETY: rank 1 and one dimension are given.
        let space = unsafe { H5Screate_simple(1, dims.as_ptr(), std::ptr::null()) };
        let set = self
            .wrap(space, H5Sclose, "set attribute", name)
            .and_then(|space| self.attach(object, name, T::file_type(), T::memory_type(), &space, values));
        self.agree(set)
    }

    /// Attaches a text to an object as a scalar of fixed length in ASCII, which is what VTK expects.
    pub fn set_text(&self, object: &str, name: &str, text: &str) -> Result<(), FileError> {
        // A string of length 0 is no valid type.
        let bytes = if text.is_empty() { b"\0" } else { text.as_bytes() };
        // SAFETY: copies of a library type and a scalar space; both are checked and closed by `wrap`.
        let (kind, space) = unsafe { (H5Tcopy(*H5T_C_S1), H5Screate(H5S_SCALAR)) };
        let set = self.wrap(kind, H5Tclose, "set attribute", name).and_then(|kind| {
            let space = self.wrap(space, H5Sclose, "set attribute", name)?;
            // SAFETY: `kind` is an open copy of the string type, the size is above 0.
            let code =
                unsafe { H5Tset_size(kind.id, bytes.len()).min(H5Tset_strpad(kind.id, H5T_STR_NULLPAD)) };
            self.check(code, "set attribute", name)?;
            self.attach(object, name, kind.id, kind.id, &space, bytes)
        });
        self.agree(set)
    }

    fn attach<T: Element>(
        &self,
        object: &str,
        name: &str,
        file_type: hid_t,
        memory_type: hid_t,
        space: &Handle,
        values: &[T],
    ) -> Result<(), FileError> {
        let (object_name, attribute) = (c_text(object), c_text(name));
        // SAFETY: open file, terminated names; `values` holds as many elements as `space` says.
        unsafe {
            let target = H5Oopen(self.id(), object_name.as_ptr(), H5P_DEFAULT);
            let target = self.wrap(target, H5Oclose, "open", object)?;
            let id = H5Acreate2(target.id, attribute.as_ptr(), file_type, space.id, H5P_DEFAULT, H5P_DEFAULT);
            let id = self.wrap(id, H5Aclose, "create attribute", name)?;
            self.check(H5Awrite(id.id, memory_type, values.as_ptr().cast()), "write attribute", name)
        }
    }

    /// Not collective. The values of a numeric attribute.
    pub fn attribute<T: Element>(&self, object: &str, name: &str) -> Result<Vec<T>, FileError> {
        let attribute = self.open_attribute(object, name)?;
        // SAFETY: open attribute, whose numbers are of the kind and size of `T`; the buffer has as many elements as its space.
        unsafe {
            let kind = self.wrap(H5Aget_type(attribute.id), H5Tclose, "read attribute", name)?;
            if H5Tget_class(kind.id) == H5T_STRING {
                return Err(self.refuse(format!("attribute {object}/{name} is a text, not a number")));
            }
            let same = H5Tget_class(kind.id) == H5Tget_class(T::file_type());
            if !(same && H5Tget_size(kind.id) == size_of::<T>()) {
                return Err(
                    self.refuse(format!("attribute {object}/{name} is no number of the kind expected"))
                );
            }
            let count = self.elements(&attribute, name)?;
            self.check_bytes(count, size_of::<T>(), || format!("attribute {object}/{name}"))?;
            let mut values = vec![T::zeroed(); count as usize];
            let code = H5Aread(attribute.id, T::memory_type(), values.as_mut_ptr().cast());
            self.check(code, "read attribute", name)?;
            Ok(values)
        }
    }

    /// Not collective. A text attribute.
    pub fn text(&self, object: &str, name: &str) -> Result<String, FileError> {
        let attribute = self.open_attribute(object, name)?;
        // SAFETY: open attribute with one element of a string type of fixed length; the buffer is as long as that.
        unsafe {
            let kind = self.wrap(H5Aget_type(attribute.id), H5Tclose, "read attribute", name)?;
            // An element of variable length would be read as the address of its text.
            let fixed = H5Tget_class(kind.id) == H5T_STRING && H5Tis_variable_str(kind.id) == 0;
            if !fixed || self.elements(&attribute, name)? != 1 {
                return Err(self.refuse(format!("attribute {object}/{name} is not one text of fixed length")));
            }
            let length = H5Tget_size(kind.id);
            self.check_bytes(1, length, || format!("attribute {object}/{name}"))?;
            let mut bytes = vec![0_u8; length];
            self.check(H5Aread(attribute.id, kind.id, bytes.as_mut_ptr().cast()), "read attribute", name)?;
            let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
            bytes.truncate(end);
            String::from_utf8(bytes)
                .map_err(|_| self.refuse(format!("attribute {object}/{name} is not UTF-8")))
        }
    }

    /// Not collective. Elements of an attribute.
    fn elements(&self, attribute: &Handle, name: &str) -> Result<u64, FileError> {
        // SAFETY: open attribute; the space is checked and closed by `wrap`.
        let count = unsafe {
            let space = self.wrap(H5Aget_space(attribute.id), H5Sclose, "read attribute", name)?;
            H5Sget_simple_extent_npoints(space.id)
        };
        u64::try_from(count).map_err(|_| self.error("read attribute", name, library_error()))
    }

    fn open_attribute(&self, object: &str, name: &str) -> Result<Handle, FileError> {
        if !self.has_attribute(object, name) {
            return Err(self.refuse(format!("attribute {name} of {object} is missing")));
        }
        let (object, attribute) = (c_text(object), c_text(name));
        // SAFETY: open file, terminated names.
        let id = unsafe {
            H5Aopen_by_name(self.id(), object.as_ptr(), attribute.as_ptr(), H5P_DEFAULT, H5P_DEFAULT)
        };
        self.wrap(id, H5Aclose, "open attribute", name)
    }
}
