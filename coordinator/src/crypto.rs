//! The one implementation of cryptography that this process uses for TLS: ring.

/// Makes ring the process's provider. Whoever opens TLS or an HTTP client calls it first; a second call changes nothing.
pub fn provide() {
    // An error means that a provider is there already: this one, for nobody installs another.
    let _there_already = rustls::crypto::ring::default_provider().install_default();
}
