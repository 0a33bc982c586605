//! Speaks to workers: lets them in, translates messages, hands them to the loop, answers. Nothing is decided here.

mod admission;
mod assets;
mod deliver;
mod enrolment;
mod work;

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use futures::Stream;
use gradfarm_proto::v1::enrolment_server::EnrolmentServer;
use gradfarm_proto::v1::farm_server::{Farm, FarmServer};
use gradfarm_proto::{limits, v1};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_stream::wrappers::TcpListenerStream;
use tonic::{Request, Response, Status, Streaming};

use crate::error::Error;
use crate::service::Handle;
use crate::tls::TlsListener;
use enrolment::EnrolmentService;

/// How often a silent connection is asked whether it still lives, and how long it may take to answer.
const KEEP_ALIVE: (Duration, Duration) = (Duration::from_secs(5), Duration::from_secs(10));

/// Largest message about a certificate [bytes]: nobody is known yet who sends one.
const ENROLMENT: usize = 64 << 10;

/// Serves workers, over TLS if the service has it, until `stop` is ready and their streams have ended.
///
/// # Errors
/// If the listener fails.
pub(crate) async fn serve(listener: TcpListener, handle: Handle, stop: impl Future<Output = ()>) -> Result<(), Error> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let secured = handle.secured().map(|secured| secured.grpc.clone());
    let enrolment = EnrolmentServer::new(EnrolmentService { handle: handle.clone() }).max_decoding_message_size(ENROLMENT);
    let service = FarmServer::new(FarmService { handle, checks: Arc::new(Semaphore::new(cores)) })
        .max_decoding_message_size(limits::MESSAGE)
        .max_encoding_message_size(limits::MESSAGE);
    let server = tonic::transport::Server::builder()
        .initial_stream_window_size(limits::WINDOWS.0)
        .initial_connection_window_size(limits::WINDOWS.1)
        .http2_keepalive_interval(Some(KEEP_ALIVE.0))
        .http2_keepalive_timeout(Some(KEEP_ALIVE.1))
        .tcp_nodelay(true)
        .add_service(service)
        .add_service(enrolment);
    match secured {
        Some(config) => {
            let io = |source| Error::Io { what: "listener for workers".into(), source };
            let listener = TlsListener::start(listener, config).map_err(io)?;
            server.serve_with_incoming_shutdown(listener, stop).await?;
        }
        None => server.serve_with_incoming_shutdown(TcpListenerStream::new(listener), stop).await?,
    }
    Ok(())
}

/// The service of `worker.proto`.
struct FarmService {
    handle: Handle,
    /// Results that are decompressed and checked at the same time: as many as there are cores.
    checks: Arc<Semaphore>,
}

type Messages<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

#[tonic::async_trait]
impl Farm for FarmService {
    type WorkStream = Messages<v1::CoordinatorMessage>;
    type FetchAssetStream = Messages<v1::AssetChunk>;

    async fn work(&self, request: Request<Streaming<v1::WorkerMessage>>) -> Result<Response<Self::WorkStream>, Status> {
        let peer = admission::admit(&self.handle, &request).await?;
        work::work(self.handle.clone(), peer, request.into_inner()).await.map(Response::new)
    }

    async fn deliver(&self, request: Request<Streaming<v1::ResultChunk>>) -> Result<Response<v1::DeliverReply>, Status> {
        let peer = admission::admit(&self.handle, &request).await?;
        let _busy = self.handle.busy();
        let reply = deliver::deliver(&self.handle, &peer, &self.checks, request.into_inner()).await?;
        if reply.outcome() == v1::deliver_reply::Outcome::Superseded {
            self.handle.metrics().superseded.inc();
        }
        Ok(Response::new(reply))
    }

    async fn fetch_asset(&self, request: Request<v1::FetchAssetRequest>) -> Result<Response<Self::FetchAssetStream>, Status> {
        admission::admit(&self.handle, &request).await?;
        assets::fetch(&self.handle, &request.into_inner()).await.map(Response::new)
    }
}

/// What a worker is told of an inner error: the loop being gone is worth another try, everything else is not its fault.
fn status(error: Error) -> Status {
    match error {
        Error::Stopped => Status::unavailable(error.to_string()),
        other => Status::internal(other.to_string()),
    }
}
