//! Speaks HTTP to a coordinator on behalf of `submit`, `status`, `watch`, `cancel` and `pull`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bytes::Bytes;
use reqwest::header::{self, HeaderMap, HeaderValue};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use serde::de::DeserializeOwned;

use super::error::Error;
use super::local_farm;
use crate::access::Secret;
use crate::api;
use crate::api::problem::Problem;

/// Where a coordinator is if nobody says otherwise.
const DEFAULT: &str = "http://127.0.0.1:7700";

/// Which coordinator to speak to, and as whom.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ServerOption {
    /// Where the coordinator listens for people [default: as DIR/address.json of --data says, otherwise http://127.0.0.1:7700]
    #[arg(long, value_name = "URL", env = "GRADFARM_SERVER", value_parser = url, help_heading = "Coordinator")]
    server: Option<String>,
    /// The coordinator's folder, where it is on this machine: its address and its token lie there
    #[arg(long, value_name = "DIR", env = "GRADFARM_DATA", default_value = "gradfarm-data", help_heading = "Coordinator")]
    data: PathBuf,
    /// File with the token to show; GRADFARM_TOKEN may hold the token itself [default: DIR/token, if that folder is this coordinator's]
    #[arg(long, value_name = "FILE", env = "GRADFARM_TOKEN_FILE", help_heading = "Coordinator")]
    token_file: Option<PathBuf>,
    /// Authority of the coordinator's certificate (PEM), for https:// [default: its own, if the folder is this coordinator's; otherwise the system's]
    #[arg(long, value_name = "FILE", env = "GRADFARM_CA", help_heading = "Coordinator")]
    ca: Option<PathBuf>,
}

/// A coordinator's address, without a slash at its end.
fn url(text: &str) -> Result<String, String> {
    let url = reqwest::Url::parse(text).map_err(|fault| format!("{fault}, expected an address such as http://127.0.0.1:7700"))?;
    let Some(host) = url.host_str() else { return Err("expected an address with a host, such as http://127.0.0.1:7700".to_owned()) };
    let here = host == "localhost" || host.trim_matches(['[', ']']).parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
    match url.scheme() {
        "https" => {}
        "http" if here => {}
        "http" => return Err(format!("{host} is not this machine, so expected an address that begins with https://: a token goes along")),
        _ => {
            return Err(
                "expected an address that begins with https://, or http:// on this machine, such as http://127.0.0.1:7700".to_owned()
            );
        }
    }
    Ok(text.trim_end_matches('/').to_owned())
}

/// The certificates of a file.
fn authorities(path: &Path) -> Result<Vec<reqwest::Certificate>, Error> {
    let wrong = |fault: &dyn std::fmt::Display| Error::Usage(format!("authority {}: {fault}", path.display()));
    let text = std::fs::read(path).map_err(|fault| wrong(&fault))?;
    let read = reqwest::Certificate::from_pem_bundle(&text).map_err(|fault| wrong(&fault))?;
    if read.is_empty() { Err(wrong(&"found no certificate, expected PEM")) } else { Ok(read) }
}

/// A coordinator at the other end of HTTP.
#[derive(Clone, Debug)]
pub(super) struct Client {
    server: String,
    http: reqwest::Client,
    /// Why requests bear no token, if they do not.
    tokenless: Option<String>,
}

impl ServerOption {
    /// The folder of the coordinator on this machine.
    pub(super) fn data(&self) -> &Path {
        &self.data
    }

    /// A client for this coordinator. Nothing is sent yet.
    ///
    /// # Errors
    /// If the token that was named cannot be read.
    pub(super) fn client(&self) -> Result<Client, Error> {
        let server = self.server.clone().or_else(|| local_farm::address(&self.data)).unwrap_or_else(|| DEFAULT.to_owned());
        let (mut headers, mut tokenless) = (HeaderMap::new(), None);
        match self.token(&server)? {
            Some(token) => {
                let value = HeaderValue::from_str(&format!("Bearer {}", token.expose()));
                let mut value = value.map_err(|_| Error::Usage("the token has characters that no token has".to_owned()))?;
                value.set_sensitive(true);
                headers.insert(header::AUTHORIZATION, value);
            }
            None => {
                tokenless = Some(format!(
                    "No token was sent: neither --token-file, GRADFARM_TOKEN_FILE nor GRADFARM_TOKEN names one, and the folder {} (--data) \
                     is not that of the coordinator at {server}.",
                    self.data.display()
                ));
            }
        }
        let http = reqwest::Client::builder();
        let http = match self.ca.clone().or_else(|| local_farm::authority(&self.data, &server)) {
            Some(path) => http.tls_certs_only(authorities(&path)?),
            None => http,
        };
        let http = http
            .default_headers(headers)
            // A token is for this coordinator, not for where it might point.
            .redirect(reqwest::redirect::Policy::none())
            .user_agent(concat!("gradfarm/", env!("CARGO_PKG_VERSION")))
            .connect_timeout(Duration::from_secs(5))
            .no_proxy()
            .build();
        let http = http.map_err(|fault| Error::Failed(format!("cannot set up HTTP: {fault}")))?;
        Ok(Client { server, http, tokenless })
    }

    /// The token to show: the one that was named, or the one in the coordinator's folder.
    fn token(&self, server: &str) -> Result<Option<Secret>, Error> {
        if let Some(path) = &self.token_file {
            return local_farm::read_token(path).map(Some);
        }
        if let Ok(text) = std::env::var("GRADFARM_TOKEN") {
            let token = Secret::parse(&text).map_err(|fault| Error::Usage(format!("GRADFARM_TOKEN: {fault}")))?;
            return Ok(Some(token));
        }
        local_farm::token(&self.data, server).map(|path| local_farm::read_token(&path)).transpose()
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
        let said = match &self.tokenless {
            Some(why) if status == StatusCode::UNAUTHORIZED => format!("{said}\n{why}"),
            _ => said,
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
        assert_eq!(url("https://farm.example.org").unwrap(), "https://farm.example.org");
        for bad in ["", "127.0.0.1:7700", "http://10.0.0.1:7700", "http://farm.example.org", "ftp://x"] {
            assert!(url(bad).is_err(), "{bad}");
        }
    }
}
