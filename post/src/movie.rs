//! Pictures one after the other in one file: APNG and GIF by this program, MP4 and WebM by `ffmpeg`.
use std::cell::RefCell;
use std::io::{self, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;

/// How frames become a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG with several frames, which browsers play.
    Apng,
    /// GIF of 256 colours for each frame.
    Gif,
    /// By `ffmpeg`, in the format of the name's ending.
    Ffmpeg,
}

impl Format {
    /// By the ending of a file; `None` if it is not known.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "png" | "apng" => Some(Self::Apng),
            "gif" => Some(Self::Gif),
            "mp4" | "webm" => Some(Self::Ffmpeg),
            _ => None,
        }
    }
}

/// A movie that is being written.
pub struct Movie {
    size: [usize; 2],
    frames_per_second: u16,
    /// Pixels of the frame before.
    before: Vec<u8>,
    sink: Sink,
}

/// Bytes in memory that are read when the writer has ended.
#[derive(Clone, Default)]
struct Bytes(Rc<RefCell<Vec<u8>>>);

impl Write for Bytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

enum Sink {
    Apng(Box<png::Writer<Bytes>>, Bytes),
    Gif(Box<gif::Encoder<Vec<u8>>>),
    Ffmpeg(Child),
}

impl Movie {
    /// Begins a movie of so many frames. `ffmpeg` writes to `path` itself; the other formats are whole in
    /// memory first.
    ///
    /// # Errors
    /// `ffmpeg` does not start.
    pub fn begin(path: &Path, format: Format, size: [usize; 2], frames: usize, fps: u16) -> io::Result<Self> {
        let [width, height] = size;
        let sink = match format {
            Format::Apng => {
                let bytes = Bytes::default();
                let mut encoder = png::Encoder::new(bytes.clone(), width as u32, height as u32);
                encoder.set_color(png::ColorType::Rgb);
                encoder.set_depth(png::BitDepth::Eight);
                encoder.set_compression(png::Compression::Best);
                if frames > 1 {
                    encoder.set_animated(frames as u32, 0)?;
                    encoder.set_frame_delay(1, fps)?;
                }
                Sink::Apng(Box::new(encoder.write_header()?), bytes)
            }
            Format::Gif => {
                let mut encoder = gif::Encoder::new(Vec::new(), width as u16, height as u16, &[])
                    .map_err(io::Error::other)?;
                encoder.set_repeat(gif::Repeat::Infinite).map_err(io::Error::other)?;
                Sink::Gif(Box::new(encoder))
            }
            Format::Ffmpeg => {
                let size = format!("{width}x{height}");
                let child = Command::new("ffmpeg")
                    .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &size])
                    .args(["-r", &fps.to_string(), "-i", "-", "-pix_fmt", "yuv420p"])
                    // Both sides must be even.
                    .args(["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2"])
                    .arg(path)
                    .stdin(Stdio::piped())
                    .spawn()?;
                Sink::Ffmpeg(child)
            }
        };
        Ok(Self { size, frames_per_second: fps, before: Vec::new(), sink })
    }

    /// Appends a frame: red, green and blue of each pixel. `gif` is the same as [`gif_frame`] makes it, where
    /// that is needed.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn push(&mut self, pixels: Vec<u8>, gif: Option<gif::Frame<'static>>) -> io::Result<()> {
        match &mut self.sink {
            Sink::Apng(writer, _) => {
                let width = self.size[0];
                if self.before.is_empty() {
                    writer.write_image_data(&pixels)?;
                } else {
                    // The rectangle that differs from the frame before is enough.
                    let [x, y, w, h] = changed(&self.before, &pixels, width);
                    writer.set_frame_position(0, 0)?;
                    writer.set_frame_dimension(w as u32, h as u32)?;
                    writer.set_frame_position(x as u32, y as u32)?;
                    let rows =
                        (y..y + h).flat_map(|row| &pixels[3 * (row * width + x)..3 * (row * width + x + w)]);
                    writer.write_image_data(&rows.copied().collect::<Vec<u8>>())?;
                }
                self.before = pixels;
            }
            Sink::Gif(encoder) => {
                if let Some(mut frame) = gif {
                    frame.delay = 100 / self.frames_per_second.max(1);
                    encoder.write_frame(&frame).map_err(io::Error::other)?;
                }
            }
            Sink::Ffmpeg(child) => {
                if let Some(input) = &mut child.stdin {
                    input.write_all(&pixels)?;
                }
            }
        }
        Ok(())
    }

    /// Ends the movie and writes its file.
    ///
    /// # Errors
    /// It cannot be written, or `ffmpeg` fails.
    pub fn finish(self, path: &Path) -> io::Result<()> {
        match self.sink {
            Sink::Apng(writer, bytes) => {
                writer.finish()?;
                agimp::io::whole_file::write_whole(path, &bytes.0.borrow())
            }
            Sink::Gif(encoder) => {
                agimp::io::whole_file::write_whole(path, &encoder.into_inner().map_err(io::Error::other)?)
            }
            Sink::Ffmpeg(mut child) => {
                drop(child.stdin.take());
                let status = child.wait()?;
                if status.success() {
                    Ok(())
                } else {
                    Err(io::Error::other(format!("ffmpeg ended with {status}")))
                }
            }
        }
    }
}

/// A frame with a palette of its own, by neural quantisation.
pub fn gif_frame(pixels: &[u8], [width, height]: [usize; 2]) -> gif::Frame<'static> {
    gif::Frame::from_rgb_speed(width as u16, height as u16, pixels, 10)
}

/// Left, top, width and height of the smallest part in which two frames differ; one pixel if they are equal.
fn changed(before: &[u8], now: &[u8], width: usize) -> [usize; 4] {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for (at, (a, b)) in before.chunks_exact(3).zip(now.chunks_exact(3)).enumerate() {
        if a != b {
            let place = [at % width, at / width];
            for axis in 0..2 {
                (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
            }
        }
    }
    if low[0] == usize::MAX {
        [0, 0, 1, 1]
    } else {
        [low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_is_found() {
        let before = vec![0; 3 * 20];
        let mut now = before.clone();
        assert_eq!(changed(&before, &now, 5), [0, 0, 1, 1]);
        now[3 * 7] = 1; // column 2, row 1
        now[3 * 14 + 2] = 1; // column 4, row 2
        assert_eq!(changed(&before, &now, 5), [2, 1, 3, 2]);
    }
}
