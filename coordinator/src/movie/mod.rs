//! What is made of frames: files with numbers in their names, movies by ffmpeg.

pub mod ffmpeg;
pub mod pattern;
