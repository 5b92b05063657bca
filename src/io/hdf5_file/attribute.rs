//! Attributes: short arrays of numbers and texts attached to groups.
use std::path::Path;

use hdf5_sys::h5::hsize_t;
use hdf5_sys::h5a::{
    H5Aclose, H5Acreate2, H5Aexists_by_name, H5Aget_space, H5Aget_type, H5Aopen_by_name, H5Aread, H5Awrite,
};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5o::{H5Oclose, H5Oopen};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::{H5S_SCALAR, H5Sclose, H5Screate, H5Screate_simple, H5Sget_simple_extent_npoints};
use hdf5_sys::h5t::{
    H5T_C_S1, H5T_CSET_ASCII, H5T_CSET_UTF8, H5T_STR_NULLPAD, H5T_STRING, H5Tclose, H5Tcopy, H5Tget_class,
    H5Tget_size, H5Tis_variable_str, H5Tset_cset, H5Tset_size, H5Tset_strpad,
};

use super::{Complaint, Element, FileError, Handle, Kind, Reader, Writer, c_text, check, library};

impl Writer {
    /// Collective. Attaches an array to an object; one value makes an array of length one.
    pub fn set_attribute<T: Element>(&self, object: &str, name: &str, values: &[T]) -> Result<(), FileError> {
        let set = self.on_rank_0(|file, path| {
            let failed = |words: Complaint| words.into_error(path, "set", name);
            let dims = [values.len() as hsize_t];
            // SAFETY: rank 1 and one dimension are given.
            let space = unsafe { H5Screate_simple(1, dims.as_ptr(), std::ptr::null()) };
            let space = Handle::new(space, H5Sclose).map_err(failed)?;
            attach(file, path, object, name, T::KIND.library_type(), &space, bytemuck::cast_slice(values))
        });
        set.map(drop)
    }

    /// Collective. Attaches a text to an object as a scalar of fixed length, in ASCII where that is enough:
    /// VTK expects it.
    pub fn set_text(&self, object: &str, name: &str, text: &str) -> Result<(), FileError> {
        self.set_texts(object, &[(name, text)])
    }

    /// Collective. Attaches texts by name to an object, as [`set_text`](Self::set_text) does.
    pub fn set_texts(&self, object: &str, texts: &[(&str, &str)]) -> Result<(), FileError> {
        let set = self.on_rank_0(|file, path| {
            texts.iter().try_for_each(|(name, text)| attach_text(file, path, object, name, text))
        });
        set.map(drop)
    }
}

fn attach_text(file: hid_t, path: &Path, object: &str, name: &str, text: &str) -> Result<(), FileError> {
    let failed = |words: Complaint| words.into_error(path, "set", name);
    // A string of length 0 is no valid type.
    let bytes = if text.is_empty() { b"\0" } else { text.as_bytes() };
    let letters = if text.is_ascii() { H5T_CSET_ASCII } else { H5T_CSET_UTF8 };
    // SAFETY: a copy of a library type and a scalar space; the size of the type is above 0.
    let (kind, space) = unsafe {
        let kind = Handle::new(H5Tcopy(*H5T_C_S1), H5Tclose).map_err(failed)?;
        let code = H5Tset_size(kind.id, bytes.len())
            .min(H5Tset_strpad(kind.id, H5T_STR_NULLPAD))
            .min(H5Tset_cset(kind.id, letters));
        check(code, path, "set", name)?;
        (kind, Handle::new(H5Screate(H5S_SCALAR), H5Sclose).map_err(failed)?)
    };
    attach(file, path, object, name, kind.id, &space, bytes)
}

/// Attaches values of a type to an object; `space` says how many elements of that type `bytes` has.
fn attach(
    file: hid_t,
    path: &Path,
    object: &str,
    name: &str,
    kind: hid_t,
    space: &Handle,
    bytes: &[u8],
) -> Result<(), FileError> {
    let failed = |words: Complaint| words.into_error(path, "set", name);
    let (object, attribute) = (c_text(object), c_text(name));
    // SAFETY: open file, terminated names; `bytes` are as many as `space` and `kind` say.
    unsafe {
        let target = H5Oopen(file, object.as_ptr(), H5P_DEFAULT);
        let target = Handle::new(target, H5Oclose).map_err(failed)?;
        let id = H5Acreate2(target.id, attribute.as_ptr(), kind, space.id, H5P_DEFAULT, H5P_DEFAULT);
        let id = Handle::new(id, H5Aclose).map_err(failed)?;
        check(H5Awrite(id.id, kind, bytes.as_ptr().cast()), path, "set", name)
    }
}

impl Reader {
    /// Not collective. True when the object has that attribute.
    pub fn has_attribute(&self, object: &str, name: &str) -> bool {
        let _turn = library();
        let (target, attribute) = (c_text(object), c_text(name));
        // SAFETY: open file, terminated names.
        let has =
            || unsafe { H5Aexists_by_name(self.id(), target.as_ptr(), attribute.as_ptr(), H5P_DEFAULT) > 0 };
        self.exists(object) && has()
    }

    /// Not collective. The values of a numeric attribute, whose numbers must be of type `T`.
    pub fn attribute<T: Element>(&self, object: &str, name: &str) -> Result<Vec<T>, FileError> {
        let _turn = library();
        let (attribute, full) = (self.open_attribute(object, name)?, format!("attribute {object}/{name}"));
        // SAFETY: open attribute, whose type is that of `T`; the buffer has as many elements as its space.
        unsafe {
            let kind = self.wrap(H5Aget_type(attribute.id), H5Tclose, &full)?;
            if Kind::of_type(kind.id) != Some(T::KIND) {
                return Err(self.refuse(format!("{full} does not hold {}", T::KIND)));
            }
            let count = self.elements(&attribute, &full)?;
            self.held_bytes(&full, count, size_of::<T>())?;
            let mut values = vec![T::zeroed(); count as usize];
            let code = H5Aread(attribute.id, T::KIND.library_type(), values.as_mut_ptr().cast());
            self.check(code, &full)?;
            Ok(values)
        }
    }

    /// Not collective. A text attribute.
    pub fn text(&self, object: &str, name: &str) -> Result<String, FileError> {
        let _turn = library();
        let (attribute, full) = (self.open_attribute(object, name)?, format!("attribute {object}/{name}"));
        // SAFETY: open attribute with one element of a string type of fixed length; the buffer is as long as
        // that.
        unsafe {
            let kind = self.wrap(H5Aget_type(attribute.id), H5Tclose, &full)?;
            // An element of variable length would be read as the address of its letters.
            let fixed = H5Tget_class(kind.id) == H5T_STRING && H5Tis_variable_str(kind.id) == 0;
            if !fixed || self.elements(&attribute, &full)? != 1 {
                return Err(self.refuse(format!("{full} is not one text of fixed length")));
            }
            let length = self.held_bytes(&full, 1, H5Tget_size(kind.id))?;
            let mut bytes = vec![0_u8; length as usize];
            self.check(H5Aread(attribute.id, kind.id, bytes.as_mut_ptr().cast()), &full)?;
            let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
            bytes.truncate(end);
            String::from_utf8(bytes).map_err(|_| self.refuse(format!("{full} is not UTF-8")))
        }
    }

    /// Not collective. Elements of an attribute.
    fn elements(&self, attribute: &Handle, name: &str) -> Result<u64, FileError> {
        // SAFETY: open attribute; the space is checked and closed by `wrap`.
        let count = unsafe {
            let space = self.wrap(H5Aget_space(attribute.id), H5Sclose, name)?;
            H5Sget_simple_extent_npoints(space.id)
        };
        u64::try_from(count).map_err(|_| Complaint::fetch().into_error(self.path(), "read", name))
    }

    fn open_attribute(&self, object: &str, name: &str) -> Result<Handle, FileError> {
        self.leads_to(object)?;
        if !self.has_attribute(object, name) {
            return Err(self.refuse(format!("attribute {name} of {object} is missing")));
        }
        let (object, attribute) = (c_text(object), c_text(name));
        // SAFETY: open file, terminated names.
        let id = unsafe {
            H5Aopen_by_name(self.id(), object.as_ptr(), attribute.as_ptr(), H5P_DEFAULT, H5P_DEFAULT)
        };
        self.wrap(id, H5Aclose, name)
    }
}
