//! How large a scene may be. Every size is held against these before anything is allocated for it.

/// Longest side of the film [pixels].
pub const FILM_SIDE: u32 = 65_536;
/// Pixels of the film (8192 × 8192).
pub const FILM_PIXELS: u64 = 1 << 26;
/// Longest path [edges].
pub const PATH_EDGES: u32 = 4_096;
/// Bytes of one file.
pub const FILE_BYTES: u64 = 1 << 31;
/// Bytes of all meshes, and of all images, that an importer makes out of other files.
pub const MADE_BYTES: u64 = 1 << 32;
/// Vertices, and triangles, of one mesh.
pub const MESH_ELEMENTS: usize = 1 << 26;
/// Texels of one image (8192 × 8192).
pub const IMAGE_PIXELS: u64 = 1 << 26;
/// Shapes written in the scene and in its groups together.
pub const SHAPES: usize = 1 << 20;
/// Shapes after every instance is counted with all that its group holds.
pub const PLACED_SHAPES: u64 = 1 << 24;
/// Depth of groups that place groups.
pub const GROUP_DEPTH: u32 = 16;
/// Nodes of an animation.
pub const NODES: usize = 1 << 16;
/// Depth of nodes that hang on one another.
pub const NODE_DEPTH: usize = 256;
/// Numbers in the keys of all tracks, tangents included.
pub const KEY_NUMBERS: usize = 1 << 24;
/// Joints of one skin.
pub const JOINTS: usize = 1 << 12;
/// Sets of four joints of a vertex.
pub const INFLUENCES: usize = 2;
/// Forms that one mesh is blended towards.
pub const MORPH_TARGETS: usize = 256;
/// Materials in one that is made of others, each counted as often as it is part of it.
pub const MATERIAL_PARTS: usize = 16;
/// Bytes of a name.
pub const NAME_BYTES: usize = 1_024;
/// Edge of the groups of pixels that reuse one another's paths [pixels].
pub const REUSE_EDGE: u32 = 16;
/// Links of a pixel to similar ones.
pub const LINKS: u32 = 16;
/// Rounds in which the samples of a frame are placed.
pub const ROUNDS: u32 = 64;
