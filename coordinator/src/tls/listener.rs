//! Accepts connections and shakes hands, many at a time, so that one who is slow to greet holds up nobody.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use futures::Stream;
use rustls::ServerConfig;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio::task::JoinHandle;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;

/// How long a handshake may take.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Most handshakes at a time.
const HANDSHAKES: usize = 256;
/// Pause after the system refused to accept, as it does when files run out.
const PAUSE: Duration = Duration::from_millis(50);

/// A connection after its handshake, and who is at the other end.
type Greeted = (TlsStream<TcpStream>, SocketAddr);

/// Listens, and hands over connections whose handshake worked.
#[derive(Debug)]
pub struct TlsListener {
    address: SocketAddr,
    greeted: mpsc::Receiver<Greeted>,
    accepting: JoinHandle<()>,
}

impl TlsListener {
    /// Begins to accept.
    ///
    /// # Errors
    /// If the listener has no address.
    pub fn start(listener: TcpListener, config: Arc<ServerConfig>) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let (sender, greeted) = mpsc::channel(HANDSHAKES);
        Ok(Self { address, greeted, accepting: tokio::spawn(accept(listener, TlsAcceptor::from(config), sender)) })
    }
}

async fn accept(listener: TcpListener, acceptor: TlsAcceptor, greeted: mpsc::Sender<Greeted>) {
    let hands = Arc::new(Semaphore::new(HANDSHAKES));
    loop {
        let Ok(hand) = hands.clone().acquire_owned().await else { return };
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(problem) => {
                tracing::debug!(%problem, "a connection could not be accepted");
                tokio::time::sleep(PAUSE).await;
                continue;
            }
        };
        let (acceptor, greeted) = (acceptor.clone(), greeted.clone());
        tokio::spawn(async move {
            let _hand = hand;
            // Where it does not work, small messages wait a little longer.
            let _slow = stream.set_nodelay(true);
            match tokio::time::timeout(HANDSHAKE, acceptor.accept(stream)).await {
                // If nobody listens any more the connection ends here.
                Ok(Ok(stream)) => drop(greeted.send((stream, peer)).await),
                Ok(Err(problem)) => tracing::debug!(%peer, %problem, "handshake failed"),
                Err(_) => tracing::debug!(%peer, "handshake took too long"),
            }
        });
    }
}

impl Drop for TlsListener {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

impl axum::serve::Listener for TlsListener {
    type Io = TlsStream<TcpStream>;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Self::Io, Self::Addr) {
        match self.greeted.recv().await {
            Some(greeted) => greeted,
            // Accepting never ends before this is dropped.
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.address)
    }
}

impl Stream for TlsListener {
    type Item = io::Result<TlsStream<TcpStream>>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.greeted.poll_recv(context).map(|greeted| greeted.map(|(stream, _)| Ok(stream)))
    }
}
