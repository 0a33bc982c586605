//! What of a frame can be looked at.

/// A view of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// What the samples say by themselves.
    Primal,
    /// Differences to the right.
    Dx,
    /// Differences downwards.
    Dy,
    /// The image that primal and differences make together.
    Reconstructed,
    /// Estimated squared error of the finished image.
    Error,
}

impl View {
    /// Every view.
    pub const ALL: [View; 5] = [View::Primal, View::Dx, View::Dy, View::Reconstructed, View::Error];

    /// Name in addresses.
    pub fn name(self) -> &'static str {
        match self {
            View::Primal => "primal",
            View::Dx => "dx",
            View::Dy => "dy",
            View::Reconstructed => "reconstructed",
            View::Error => "error",
        }
    }

    /// A view by name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|view| view.name() == name)
    }

    /// Its layer in a frame's EXR file.
    pub(super) fn layer(self) -> &'static str {
        match self {
            View::Reconstructed => "",
            other => other.name(),
        }
    }

    /// When it can be seen, for people.
    pub(super) fn needs(self) -> &'static str {
        match self {
            View::Primal => "there once a worker has delivered something",
            View::Dx | View::Dy => "there once a worker has delivered something, where the technique measures differences",
            View::Reconstructed => "there once every tile has results",
            View::Error => "there once the frame is done",
        }
    }
}
