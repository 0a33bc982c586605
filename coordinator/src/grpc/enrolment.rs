//! Certificates for workers: the first one for a join token, the next ones for the one before.

use gradfarm_proto::v1;
use gradfarm_proto::v1::enrolment_server::Enrolment;
use tonic::{Request, Response, Status};

use super::admission;
use crate::authority::EnrolError;
use crate::service::Handle;
use crate::tls::Secured;

/// The service of `enrolment.proto`.
pub(super) struct EnrolmentService {
    pub(super) handle: Handle,
}

impl EnrolmentService {
    fn secured(&self) -> Result<&Secured, Status> {
        self.handle.secured().ok_or_else(|| Status::failed_precondition("the coordinator speaks no TLS, and enrols nobody"))
    }
}

#[tonic::async_trait]
impl Enrolment for EnrolmentService {
    async fn enrol(&self, request: Request<v1::EnrolRequest>) -> Result<Response<v1::EnrolReply>, Status> {
        let registry = &self.secured()?.registry;
        let v1::EnrolRequest { request, token, name } = request.into_inner();
        let enrolled = registry.enrol(&token, &request, &name).await;
        let outcome = enrolled.as_ref().map_or_else(ToString::to_string, |_| "joined".to_owned());
        // Whoever guesses must not be able to fill the log.
        if !matches!(enrolled, Err(EnrolError::Unknown)) {
            let name: String = name.chars().filter(|c| !c.is_control()).collect();
            self.handle.gate().audit().note(&format!("worker {name}"), "", "enrolment", &outcome).await;
        }
        let certificate = enrolled.map_err(refusal)?;
        Ok(Response::new(v1::EnrolReply { certificate }))
    }

    async fn renew(&self, request: Request<v1::RenewRequest>) -> Result<Response<v1::EnrolReply>, Status> {
        let registry = &self.secured()?.registry;
        let identity = admission::certificate(&self.handle, &request).await?;
        let identity = identity.ok_or_else(|| Status::unauthenticated("a certificate is renewed by whoever shows it"))?;
        let certificate = registry.renew(&identity, &request.into_inner().request).await.map_err(refusal)?;
        Ok(Response::new(v1::EnrolReply { certificate }))
    }
}

/// What a worker is told.
pub(super) fn refusal(error: EnrolError) -> Status {
    match &error {
        EnrolError::Unknown | EnrolError::Used | EnrolError::Expired | EnrolError::Revoked(_) | EnrolError::Stranger(_) => {
            Status::permission_denied(error.to_string())
        }
        EnrolError::Request(_) | EnrolError::Invalid(_) => Status::invalid_argument(error.to_string()),
        EnrolError::Store(fault) => {
            tracing::error!(%fault, "the register of workers cannot be read");
            Status::unavailable("the register of workers does not answer")
        }
    }
}
