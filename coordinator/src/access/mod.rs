//! Who may do what: tokens with roles, how they are kept, and the gate that every request passes.
//!
//! `secret` draws and hashes, `role` orders what people may do, `token` judges one token by itself, `gate` knows them all through the
//! store, `oidc` believes an identity provider, `rate` bounds how often somebody may ask, `audit` remembers who changed what, `files` hands the first ones to the user of this machine. What is judged is pure; only the gate and the files touch the world.

mod audit;
mod files;
mod gate;
mod oidc;
mod rate;
mod role;
mod secret;
mod token;

pub use audit::{Audit, AuditEntry};
pub use files::{PrivateFileError, WORKER_TOKEN, write_private};
pub use gate::{Gate, Issued, NewToken, Refusal, TokenView};
pub use oidc::{OidcError, OidcOptions};
pub use role::{ParseRoleError, Role};
pub use secret::{Secret, SecretError};
pub use token::{Caller, Denied, Token};

pub use files::{ADMIN_TOKEN, hand_out};
pub(crate) use gate::{check_name, decode, encode};
pub(crate) use rate::Rate;
pub(crate) use secret::hash;
pub(crate) use token::id_of;
