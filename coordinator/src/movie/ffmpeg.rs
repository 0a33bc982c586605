//! Movies by ffmpeg, where it is installed: frames go in as PNG files, one after the other.

use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

/// What a movie is packed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// MPEG-4, for H.264.
    Mp4,
    /// WebM, for VP9.
    Webm,
}

impl Container {
    /// The container that the name of a file asks for.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "mp4" => Some(Self::Mp4),
            "webm" => Some(Self::Webm),
            _ => None,
        }
    }

    /// ffmpeg's name for it.
    fn name(self) -> &'static str {
        match self {
            Self::Mp4 => "mp4",
            Self::Webm => "webm",
        }
    }

    /// Encoders that it takes, the best first, each with what makes it look good.
    fn encoders(self) -> &'static [(&'static str, &'static [&'static str])] {
        match self {
            Self::Mp4 => &[("libx264", &["-crf", "16", "-preset", "medium"]), ("libopenh264", &["-b:v", "8M"]), ("mpeg4", &["-q:v", "2"])],
            Self::Webm => &[("libvpx-vp9", &["-crf", "20", "-b:v", "0"]), ("libvpx", &["-crf", "8", "-b:v", "8M"])],
        }
    }
}

/// The program, with an encoder for a container.
#[derive(Clone, Debug)]
pub struct Ffmpeg {
    program: PathBuf,
    container: Container,
    encoder: &'static str,
    settings: &'static [&'static str],
}

impl Ffmpeg {
    /// Looks for ffmpeg in the folders of PATH, and for an encoder that it has.
    ///
    /// # Errors
    /// What is missing.
    pub fn find(container: Container) -> Result<Self, String> {
        Self::find_in(std::env::var_os("PATH").as_deref(), container)
    }

    fn find_in(folders: Option<&OsStr>, container: Container) -> Result<Self, String> {
        let name = format!("ffmpeg{}", std::env::consts::EXE_SUFFIX);
        let program = folders
            .into_iter()
            .flat_map(std::env::split_paths)
            .map(|folder| folder.join(&name))
            .find(|file| file.is_file())
            .ok_or("ffmpeg, which makes movies, is in no folder of PATH")?;
        let told = Command::new(&program).args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).stderr(Stdio::null()).output();
        let told = told.map_err(|fault| format!("{} does not start: {fault}", program.display()))?;
        let told = String::from_utf8_lossy(&told.stdout);
        let has = |encoder: &str| told.split_whitespace().any(|word| word == encoder);
        let known = container.encoders();
        let (encoder, settings) = known.iter().copied().find(|(encoder, _)| has(encoder)).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|(encoder, _)| *encoder).collect();
            format!("{} has no encoder for {}, expected one of {}", program.display(), container.name(), names.join(", "))
        })?;
        Ok(Self { program, container, encoder, settings })
    }

    /// Starts a movie of so many frames a second. The file appears as the frames come.
    ///
    /// # Errors
    /// If ffmpeg does not start.
    pub fn start(&self, fps: f64, output: &Path) -> Result<Encoding, String> {
        let mut child = Command::new(&self.program)
            .args(["-hide_banner", "-loglevel", "error", "-nostats", "-y"])
            .args(["-f", "image2pipe", "-framerate", &fps.to_string(), "-c:v", "png", "-i", "-"])
            .args(["-c:v", self.encoder])
            .args(self.settings)
            // Most players want colour at half the resolution, which takes even edges: an odd one gets a black line more.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p"])
            .args(["-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-colorspace", "bt709", "-color_range", "tv"])
            .args(["-fflags", "+bitexact", "-f", self.container.name()])
            .arg(output)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|fault| format!("{} does not start: {fault}", self.program.display()))?;
        let errors = child.stderr.take().map(|mut errors| {
            std::thread::spawn(move || {
                let mut said = Vec::new();
                let _ = errors.read_to_end(&mut said);
                String::from_utf8_lossy(&said).trim().to_owned()
            })
        });
        Ok(Encoding { input: child.stdin.take(), child, errors })
    }
}

/// A movie while its frames come in. Dropped before its end, ffmpeg is stopped.
#[derive(Debug)]
pub struct Encoding {
    child: Child,
    input: Option<ChildStdin>,
    errors: Option<JoinHandle<String>>,
}

impl Encoding {
    /// Adds the next frame, a PNG file.
    ///
    /// # Errors
    /// What ffmpeg said when it stopped.
    pub fn frame(&mut self, png: &[u8]) -> Result<(), String> {
        let written = self.input.as_mut().map_or(Err(std::io::ErrorKind::BrokenPipe.into()), |input| input.write_all(png));
        written.map_err(|fault| self.end().err().unwrap_or_else(|| format!("ffmpeg takes no more frames: {fault}")))
    }

    /// Ends the movie.
    ///
    /// # Errors
    /// What ffmpeg said if it failed.
    pub fn finish(mut self) -> Result<(), String> {
        self.end()
    }

    fn end(&mut self) -> Result<(), String> {
        // ffmpeg writes the end of the file once nothing more can come.
        drop(self.input.take());
        let status = self.child.wait().map_err(|fault| format!("ffmpeg is gone: {fault}"))?;
        let said = self.errors.take().and_then(|errors| errors.join().ok()).unwrap_or_default();
        if status.success() {
            return Ok(());
        }
        let said = said.lines().last().filter(|line| !line.is_empty()).unwrap_or("it said nothing").to_owned();
        Err(format!("ffmpeg failed with {status}: {said}"))
    }
}

impl Drop for Encoding {
    fn drop(&mut self) {
        if self.input.is_some() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_the_container() {
        assert_eq!(Container::of(Path::new("a.MP4")), Some(Container::Mp4));
        assert_eq!(Container::of(Path::new("x/a.webm")), Some(Container::Webm));
        assert_eq!([Container::of(Path::new("a.avi")), Container::of(Path::new("mp4"))], [None, None]);
    }

    #[test]
    fn a_missing_program_is_told() {
        let folder = tempfile::tempdir().unwrap();
        for path in [None, Some(OsStr::new("")), Some(folder.path().as_os_str())] {
            let fault = Ffmpeg::find_in(path, Container::Mp4).unwrap_err();
            assert!(fault.contains("in no folder of PATH"), "{fault}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_program_without_encoders_or_that_fails_is_told() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("ffmpeg");
        let write = |text: &str| {
            std::fs::write(&program, format!("#!/bin/sh\n{text}\n")).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        };
        write("echo ' V..... libx265 HEVC'");
        let fault = Ffmpeg::find_in(Some(folder.path().as_os_str()), Container::Webm).unwrap_err();
        assert!(fault.contains("no encoder for webm, expected one of libvpx-vp9"), "{fault}");
        write("case $* in *-encoders*) echo ' V..... mpeg4 MPEG-4';; *) echo 'first' >&2; echo 'no room for frames' >&2; exit 3;; esac");
        let ffmpeg = Ffmpeg::find_in(Some(folder.path().as_os_str()), Container::Mp4).unwrap();
        assert_eq!(ffmpeg.encoder, "mpeg4");
        let mut movie = ffmpeg.start(24.0, &folder.path().join("a.mp4")).unwrap();
        // However far it gets, the end tells what was said.
        let fault = (0..100).find_map(|_| movie.frame(&[0; 65536]).err()).unwrap();
        assert!(fault.contains("no room for frames"), "{fault}");
    }
}
