//! Speaks HTTP to a coordinator on behalf of `submit`, `status`, `watch`, `cancel` and `pull`.

use std::time::Duration;

use bytes::Bytes;
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use serde::de::DeserializeOwned;

use super::error::Error;
use crate::api;
use crate::api::problem::Problem;

/// Which coordinator to speak to.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ServerOption {
    /// Where the coordinator listens for people
    #[arg(long, value_name = "URL", env = "GRADFARM_SERVER", default_value = "http://127.0.0.1:7700", value_parser = url)]
    server: String,
}

/// A coordinator's address, without a slash at its end.
fn url(text: &str) -> Result<String, String> {
    let url = reqwest::Url::parse(text).map_err(|fault| format!("{fault}, expected an address such as http://127.0.0.1:7700"))?;
    if url.scheme() != "http" || url.host_str().is_none() {
        return Err("expected an address that begins with http://, such as http://127.0.0.1:7700".to_owned());
    }
    Ok(text.trim_end_matches('/').to_owned())
}

/// A coordinator at the other end of HTTP.
#[derive(Clone, Debug)]
pub(super) struct Client {
    server: String,
    http: reqwest::Client,
}

impl ServerOption {
    /// A client for this coordinator. Nothing is sent yet.
    pub(super) fn client(&self) -> Result<Client, Error> {
        let http = reqwest::Client::builder()
            .user_agent(concat!("gradfarm/", env!("CARGO_PKG_VERSION")))
            .connect_timeout(Duration::from_secs(5))
            // Coordinators are on loopback: no proxy can reach ours.
            .no_proxy()
            .build();
        let http = http.map_err(|fault| Error::Failed(format!("cannot set up HTTP: {fault}")))?;
        Ok(Client { server: self.server.clone(), http })
    }
}

impl Client {
    /// The coordinator's address.
    pub(super) fn server(&self) -> &str {
        &self.server
    }

    /// A request to an address below the API's root.
    pub(super) fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.http.request(method, format!("{}{}{path}", self.server, api::ROOT))
    }

    /// Gets a JSON answer.
    ///
    /// # Errors
    /// As [`send`](Self::send), and if the answer is none of ours.
    pub(super) async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, Error> {
        let response = self.send(self.request(Method::GET, path)).await?;
        self.read(response).await
    }

    /// Sends a request; an answer that is not a success becomes an error that says what the coordinator said.
    ///
    /// # Errors
    /// [`Error::Unreachable`], [`Error::Usage`] if the request is at fault, [`Error::Failed`] if the coordinator is.
    pub(super) async fn send(&self, request: RequestBuilder) -> Result<Response, Error> {
        let response = request.send().await.map_err(|fault| self.unreachable(&fault))?;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        let body = response.bytes().await.unwrap_or_default();
        let said = match serde_json::from_slice::<Problem>(&body) {
            Ok(problem) => problem.detail,
            Err(_) => format!("{} answered {status}", self.server),
        };
        Err(if status.is_client_error() && status != StatusCode::REQUEST_TIMEOUT { Error::Usage(said) } else { Error::Failed(said) })
    }

    /// Reads a JSON body.
    ///
    /// # Errors
    /// If the connection breaks, or the answer is none of ours.
    pub(super) async fn read<T: DeserializeOwned>(&self, response: Response) -> Result<T, Error> {
        let body = self.bytes(response).await?;
        serde_json::from_slice(&body).map_err(|fault| Error::Failed(format!("{} is no coordinator of this version: {fault}", self.server)))
    }

    /// Reads a body.
    ///
    /// # Errors
    /// If the connection breaks.
    pub(super) async fn bytes(&self, response: Response) -> Result<Bytes, Error> {
        response.bytes().await.map_err(|fault| self.unreachable(&fault))
    }

    /// The error for a connection that could not be made, or broke.
    pub(super) fn unreachable(&self, fault: &reqwest::Error) -> Error {
        // reqwest's own message repeats the address; what the system said is at the end of the chain.
        let mut cause: &dyn std::error::Error = fault;
        while let Some(deeper) = cause.source() {
            cause = deeper;
        }
        Error::Unreachable { server: self.server.clone(), reason: cause.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_checked_before_anything_is_sent() {
        assert_eq!(url("http://127.0.0.1:7700/").unwrap(), "http://127.0.0.1:7700");
        for bad in ["", "127.0.0.1:7700", "https://127.0.0.1", "ftp://x"] {
            assert!(url(bad).is_err(), "{bad}");
        }
    }
}
