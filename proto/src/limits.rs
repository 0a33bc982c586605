//! Bounds that both sides keep, so that no message makes its reader allocate without limit.

/// Largest gRPC message either side accepts [bytes].
pub const MESSAGE: usize = 4 << 20;
/// Largest chunk of a result or an asset [bytes].
pub const CHUNK: usize = 1 << 20;
/// Largest encoding of a block before compression [bytes].
pub const BLOCK: u64 = 512 << 20;
/// Largest encoding of an image between two stages of a job [bytes]: 15 channels of the largest film.
pub const IMAGE: u64 = 4 * 15 * PIXELS + 16;
/// Largest asset [bytes].
pub const ASSET: u64 = 4 << 30;
/// Most assets of one scene.
pub const ASSETS: usize = 100_000;
/// Longest name of an asset [bytes].
pub const ASSET_NAME: usize = 4096;
/// Longest edge of a film [pixels].
pub const EDGE: u32 = 1 << 16;
/// Most pixels of a film.
pub const PIXELS: u64 = 1 << 28;
/// Most samples per pixel.
pub const SAMPLES: u32 = 1 << 30;
/// Most leases in one message.
pub const LEASES: usize = 4096;
/// Most reasons in a plan, and most counters in a block.
pub const LINES: usize = 256;
/// Most tags of a worker, and of what a job asks for.
pub const TAGS: usize = 64;
/// Longest name of a pool, a tag, a project or a limit [bytes].
pub const TAG: usize = 64;
/// Longest reason in a plan or for a failure [bytes].
pub const TEXT: usize = 4096;
/// HTTP/2 flow-control window of one stream and of one connection [bytes].
pub const WINDOWS: (u32, u32) = (4 << 20, 16 << 20);
