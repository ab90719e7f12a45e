//! A running console.

use crate::app::{App, Clock, random};
use crate::authority::Authority;
use crate::config::ConsoleConfig;
use crate::fleet::Fleet;
use crate::gate;
use crate::page::Page;
use crate::plans::{Drafts, Rehearsals};
use crate::recording::Recorder;
use crate::secret::{CLAIM_CHARACTERS, claim_code, claim_digest};
use crate::server::{self, Places};
use crate::store::Store;
use crate::tls::Certificate;
use crate::{AuthorityError, CertificateError, Directory, LinkError, StoreError, password};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinHandle;
use tokio_rustls::TlsAcceptor;

/// Why a console does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// What is kept.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The page's certificate.
    #[error(transparent)]
    Certificate(#[from] CertificateError),
    /// What devices are to trust.
    #[error(transparent)]
    Authority(#[from] AuthorityError),
    /// The way to the drones.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// TLS.
    #[error("TLS: {0}")]
    Tls(#[from] rustls::Error),
    /// A port, or the system's randomness.
    #[error("{0}")]
    System(String),
}

/// The certificate's files are looked at this often.
const LOOK: Duration = Duration::from_secs(2);

/// A console that serves until it is dropped.
pub struct Console {
    /// Where it listens: the port that was given for port 0.
    pub address: SocketAddr,
    /// The claim code to be shown to who installs it; `None` once claimed.
    pub claim: Option<String>,
    certificate: Arc<Certificate>,
    rehearsals: Rehearsals,
    recorder: Option<Arc<Recorder>>,
    tasks: Vec<JoinHandle<()>>,
}

impl Console {
    /// Opens everything and begins to serve.
    ///
    /// # Errors
    /// One sentence about what is wrong.
    pub async fn start(
        config: &ConsoleConfig,
        page: Page,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, StartError> {
        let store = Store::open(&config.data)?;
        let certificate = Arc::new(Certificate::read(&config.https.certificate, &config.https.key)?);
        let authority = config.https.authority.as_deref().map(Authority::read).transpose()?;
        let tls = TlsAcceptor::from(Arc::new(certificate.server()?));
        let listener =
            server::listen(config.https.listen).map_err(|error| StartError::System(error.to_string()))?;
        let address = listener.local_addr().map_err(|error| StartError::System(error.to_string()))?;
        let redirect = match config.https.redirect {
            Some(place) => {
                Some(server::listen(place).map_err(|error| StartError::System(error.to_string()))?)
            }
            None => None,
        };
        let claim = offer(&store).await?;
        let directory =
            Directory::new(store.accounts().await?, store.sessions().await?, config.session.lifetime());
        let salt = random::<16>().map_err(|error| StartError::System(error.to_string()))?;
        let decoy = password::decoy(salt).map_err(|error| StartError::System(error.to_string()))?;
        let recorder = Recorder::open(config.recording, &config.data, store.clone(), clock.clone())
            .await
            .map_err(StartError::System)?;
        let fleet = Fleet::open(
            &config.zenoh,
            store.clone(),
            clock.clone(),
            &store.drones_seen().await?,
            recorder.clone(),
        )
        .await?;
        let rehearsals = Rehearsals::new(&config.rehearsal, &config.data);
        let plans = (Drafts::new(&config.data), rehearsals.clone());
        let app = Arc::new(App::new(store, fleet, (page, authority), plans, clock, directory, decoy));
        let places = Places::new(config.https.connections, config.https.connections_an_address);
        let mut tasks = vec![
            tokio::spawn(server::serve(listener, tls, places, gate::router(app))),
            tokio::spawn(look(certificate.clone())),
        ];
        if let Some(listener) = redirect {
            // Places of its own: whoever fills these does not shut the page.
            tasks.push(tokio::spawn(server::redirect(listener, address.port(), Places::new(64, 16))));
        }
        Ok(Self { address, claim, certificate, rehearsals, recorder, tasks })
    }

    /// Reads the page's certificate again, now.
    ///
    /// # Errors
    /// What is wrong with the new one; the old one stays in use.
    pub fn read_certificate_again(&self) -> Result<(), CertificateError> {
        self.certificate.read_again()
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.rehearsals.end();
        for task in &self.tasks {
            task.abort();
        }
        if let Some(recorder) = &self.recorder {
            recorder.end();
        }
    }
}

async fn look(certificate: Arc<Certificate>) {
    let mut every = tokio::time::interval(LOOK);
    loop {
        every.tick().await;
        if certificate.has_changed() {
            match certificate.read_again() {
                Ok(()) => tracing::info!("the page's certificate was read again"),
                Err(error) => tracing::error!("{error}: the one in use stays"),
            }
        }
    }
}

/// Draws a claim code and keeps its digest; `None` when the console has been claimed.
async fn offer(store: &Store) -> Result<Option<String>, StartError> {
    let random = random::<CLAIM_CHARACTERS>().map_err(|error| StartError::System(error.to_string()))?;
    let code = claim_code(random);
    Ok(store.offer_claim(claim_digest(&code)).await?.then_some(code))
}

/// A fresh claim code for a console that may be running; older ones count no more.
///
/// # Errors
/// When the data folder cannot be used, or the console has been claimed.
pub async fn claim_again(config: &ConsoleConfig) -> Result<String, StartError> {
    let store = Store::open(&config.data)?;
    offer(&store).await?.ok_or(StartError::Store(StoreError::Claimed))
}
