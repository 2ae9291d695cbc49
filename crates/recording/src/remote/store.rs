//! The store of an address, and its errors in words.

use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::Duration;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpService,
    ReqwestConnector,
};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::path::Path as Key;
use object_store::{
    BackoffConfig, ClientConfigKey, ClientOptions, Error, HeaderValue, ObjectStore, RetryConfig,
};

use crate::address::{is_http, open_part, scheme, whole};

/// Retries of a request that failed, and for how long.
const RETRIES: usize = 6;
const RETRIES_TIMEOUT: Duration = Duration::from_secs(60);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// How long a server may be silent, and how long a piece may take: 8 MiB at a quarter of a megabit
/// a second. The environment can say otherwise.
const SILENCE: (ClientConfigKey, &str, &str) =
    (ClientConfigKey::ReadTimeout, "READ_TIMEOUT", "20 seconds");
const WHOLE: (ClientConfigKey, &str, &str) = (ClientConfigKey::Timeout, "TIMEOUT", "300 seconds");

const S3_CREDENTIALS: &str = "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or \
                              AWS_SKIP_SIGNATURE=true for what is public";
const GOOGLE_CREDENTIALS: &str =
    "set GOOGLE_SERVICE_ACCOUNT, or GOOGLE_SKIP_SIGNATURE=true for what is public";
const AZURE_CREDENTIALS: &str = "set AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY, or \
                                 AZURE_SKIP_SIGNATURE=true for what is public";
const HTTP_CREDENTIALS: &str =
    "the query of the address, or its user and password, may be wrong or out of date";

/// Where an object is.
#[derive(Debug)]
pub(super) struct Place {
    pub(super) store: Box<dyn ObjectStore>,
    pub(super) key: Key,
    /// Whether the store gives the last bytes of an object of unknown size.
    pub(super) gives_ends: bool,
    /// What to set if access is denied.
    pub(super) credentials: &'static str,
}

impl Place {
    /// The place of an address, with the settings of the environment for its kind of store.
    pub(super) fn of(address: &Path) -> io::Result<Self> {
        let address = address.to_str().ok_or(ErrorKind::InvalidInput)?;
        let scheme = scheme(address).unwrap_or_default();
        if is_http(scheme) {
            return web_server(address);
        }
        let rest = &address[scheme.len() + "://".len()..];
        let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
        if bucket.is_empty() || key.is_empty() {
            return Err(wrong(format!("names no object; use {scheme}://BUCKET/OBJECT")));
        }
        let key = Key::parse(key).map_err(wrong)?;
        let place = |store, credentials| Place { store, key, gives_ends: true, credentials };
        match scheme.to_ascii_lowercase().as_str() {
            "s3" | "s3a" => Ok(place(s3(bucket)?, S3_CREDENTIALS)),
            "gs" => Ok(place(google(bucket)?, GOOGLE_CREDENTIALS)),
            "az" | "abfs" | "abfss" => Ok(Place {
                // Azure has no ranges that count from the end.
                gives_ends: false,
                ..place(azure(&format!("{scheme}://{bucket}/"))?, AZURE_CREDENTIALS)
            }),
            _ => {
                Err(wrong("is an address of an unknown kind; known are s3, gs, az, http and https"))
            }
        }
    }
}

/// Those of the two timeouts that the environment does not set.
fn timeouts(prefix: &str) -> impl Iterator<Item = (ClientConfigKey, &'static str)> {
    let is_set = move |name: &str| std::env::var_os(format!("{prefix}_{name}")).is_some();
    let open = [SILENCE, WHOLE].into_iter().filter(move |(_, name, _)| !is_set(name));
    open.map(|(key, _, value)| (key, value))
}

fn retries() -> RetryConfig {
    let backoff = BackoffConfig { max_backoff: LONGEST_PAUSE, ..BackoffConfig::default() };
    RetryConfig { backoff, max_retries: RETRIES, retry_timeout: RETRIES_TIMEOUT }
}

fn s3(bucket: &str) -> io::Result<Box<dyn ObjectStore>> {
    use_ring();
    let builder = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retries());
    let builder = timeouts("AWS").fold(builder, |builder, (key, value)| {
        builder.with_config(AmazonS3ConfigKey::Client(key), value)
    });
    Ok(Box::new(builder.build().map_err(|error| unusable(&error, S3_CREDENTIALS))?))
}

fn google(bucket: &str) -> io::Result<Box<dyn ObjectStore>> {
    use_ring();
    let builder =
        GoogleCloudStorageBuilder::from_env().with_bucket_name(bucket).with_retry(retries());
    let builder = timeouts("GOOGLE").fold(builder, |builder, (key, value)| {
        builder.with_config(GoogleConfigKey::Client(key), value)
    });
    Ok(Box::new(builder.build().map_err(|error| unusable(&error, GOOGLE_CREDENTIALS))?))
}

fn azure(container: &str) -> io::Result<Box<dyn ObjectStore>> {
    use_ring();
    let builder = MicrosoftAzureBuilder::from_env().with_url(container).with_retry(retries());
    let builder = timeouts("AZURE").fold(builder, |builder, (key, value)| {
        builder.with_config(AzureConfigKey::Client(key), value)
    });
    Ok(Box::new(builder.build().map_err(|error| unusable(&error, AZURE_CREDENTIALS))?))
}

fn web_server(address: &str) -> io::Result<Place> {
    use_ring();
    if open_part(address) != address && whole(address) == address {
        return Err(wrong(
            "has a query or a password, which `address::put_secrets_aside` is to put aside first",
        ));
    }
    let exact = Exact::of(&whole(address));
    let options = ClientOptions::new().with_allow_http(true);
    let options = [SILENCE, WHOLE]
        .into_iter()
        .fold(options, |options, (key, _, value)| options.with_config(key, value));
    let store = HttpBuilder::new()
        .with_url(open_part(address))
        .with_client_options(options)
        .with_retry(retries())
        .with_http_connector(exact)
        .build()
        .map_err(|error| wrong(innermost(&error)))?;
    Ok(Place {
        store: Box::new(store),
        key: Key::from("-"),
        gives_ends: true,
        credentials: HTTP_CREDENTIALS,
    })
}

/// TLS by ring for the whole process, unless it has another already.
fn use_ring() {
    let _ = rustls::crypto::ring::default_provider().install_default();
}

/// Requests one address exactly as it was given, however the client encodes it.
#[derive(Debug, Clone)]
struct Exact {
    address: String,
    /// User and password, as they are sent.
    authorization: Option<HeaderValue>,
}

impl Exact {
    fn of(whole: &str) -> Self {
        let address = whole.split('#').next().unwrap_or_default();
        let start = address.find("://").map_or(0, |at| at + "://".len());
        let end = address[start..].find(['/', '?']).map_or(address.len(), |at| start + at);
        let Some((user, _)) = address[start..end].rsplit_once('@') else {
            return Exact { address: address.to_owned(), authorization: None };
        };
        let sent = format!("Basic {}", BASE64_STANDARD.encode(decoded(user)));
        let authorization = HeaderValue::from_str(&sent).ok().map(|mut value| {
            value.set_sensitive(true);
            value
        });
        let address = format!("{}{}", &address[..start], &address[start + user.len() + 1..]);
        Exact { address, authorization }
    }
}

/// Decodes bytes that are written as `%` and two digits.
fn decoded(text: &str) -> Vec<u8> {
    let mut pieces = text.split('%');
    let mut bytes = pieces.next().unwrap_or_default().as_bytes().to_vec();
    for piece in pieces {
        match piece.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => bytes.extend([&[byte], &piece.as_bytes()[2..]].concat()),
            None => bytes.extend([b"%", piece.as_bytes()].concat()),
        }
    }
    bytes
}

impl HttpConnector for Exact {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let inner = ReqwestConnector::default().connect(options)?;
        Ok(HttpClient::new(ExactService { inner, exact: self.clone() }))
    }
}

#[derive(Debug)]
struct ExactService {
    inner: HttpClient,
    exact: Exact,
}

impl HttpService for ExactService {
    fn call<'a, 'b>(
        &'a self,
        mut request: HttpRequest,
    ) -> std::pin::Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'b>>
    where
        'a: 'b,
        Self: 'b,
    {
        Box::pin(async move {
            // The message of the parser could name secrets.
            let uri = self.exact.address.parse();
            let uri = uri.map_err(|_| {
                HttpError::new(HttpErrorKind::Unknown, wrong("not a valid address"))
            })?;
            *request.uri_mut() = uri;
            if let Some(value) = &self.exact.authorization {
                request.headers_mut().insert("authorization", value.clone());
            }
            self.inner.execute(request).await
        })
    }
}

fn wrong(problem: impl ToString) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, problem.to_string())
}

/// An error of a store that cannot be set up.
fn unusable(error: &Error, credentials: &str) -> io::Error {
    wrong(format!("{}; {credentials}", innermost(error)))
}

/// Whether a server has no range of an object to give, since it is empty.
pub(super) fn is_empty_object(error: &Error) -> bool {
    status(error).is_some_and(|status| status.starts_with("416"))
}

/// The object is not the one that was opened.
pub(super) fn changed() -> io::Error {
    io::Error::other("the object changed while it was read")
}

/// An error in one line without addresses.
pub(super) fn words(place: &Place, error: &Error) -> io::Error {
    let code = code(error).map_or(String::new(), |code| format!(" ({code})"));
    let (kind, problem) = match error {
        Error::NotFound { .. } => (ErrorKind::NotFound, format!("not found{code}")),
        Error::PermissionDenied { .. } => {
            (ErrorKind::PermissionDenied, format!("access denied{code}; {}", place.credentials))
        }
        Error::Unauthenticated { .. } => {
            (ErrorKind::PermissionDenied, format!("not let in{code}; {}", place.credentials))
        }
        Error::Precondition { .. } => return changed(),
        _ if gives_no_part(error) => (
            ErrorKind::Unsupported,
            "the server gives no parts of it (it answers no range requests); download it, or pipe \
             it: `curl ADDRESS | divmerge annotate - -o OUT.mcap`"
                .to_owned(),
        ),
        _ if asks_machine(error) => (
            ErrorKind::PermissionDenied,
            format!("no credentials, and this machine has none to give; {}", place.credentials),
        ),
        _ if is_elsewhere(error) => {
            (ErrorKind::Other, "the bucket is in another region; set AWS_REGION".to_owned())
        }
        _ => match status(error) {
            Some(status) => (ErrorKind::Other, format!("the server says {status}{code}")),
            None => (ErrorKind::Other, format!("cannot be read: {}", innermost(error))),
        },
    };
    io::Error::new(kind, problem)
}

/// Whether a server gave the whole object where a part was requested.
pub(super) fn gives_no_part(error: &Error) -> bool {
    chain(error).any(|said| {
        said.starts_with("Range request not supported") || said.starts_with("Received non-partial")
    })
}

/// Whether a store sends to another region, or wants requests signed for it.
fn is_elsewhere(error: &Error) -> bool {
    const SAID: [&str; 2] = ["Received redirect without LOCATION", "AuthorizationHeaderMalformed"];
    chain(error).any(|said| SAID.iter().any(|known| said.contains(known)))
}

/// Whether the machine's own service for credentials failed, not the store.
fn asks_machine(error: &Error) -> bool {
    const SERVICES: [&str; 4] =
        ["//169.254.169.254", "//metadata.google.internal", "//169.254.170.2", "/latest/api/token"];
    chain(error).any(|said| SERVICES.iter().any(|service| said.contains(service)))
}

/// The status of a response that is an error.
fn status(error: &Error) -> Option<String> {
    const BEFORE: &str = "Server returned non-2xx status code: ";
    chain(error).find_map(|said| {
        let status = said.strip_prefix(BEFORE)?;
        Some(status.split(':').next().unwrap_or(status).trim().to_owned())
    })
}

/// The code in the body of an error response.
fn code(error: &Error) -> Option<String> {
    chain(error).find_map(|said| {
        let (_, rest) = said.split_once("<Code>")?;
        let (code, _) = rest.split_once("</Code>")?;
        code.chars().all(|c| c.is_ascii_alphanumeric()).then(|| code.to_owned())
    })
}

/// The first line of the innermost cause.
fn innermost(error: &Error) -> String {
    let said = chain(error).last().unwrap_or_default();
    match said.lines().next().unwrap_or_default() {
        "URL scheme is not allowed" => {
            "http without TLS; AWS_ALLOW_HTTP=true, GOOGLE_ALLOW_HTTP=true or \
             AZURE_ALLOW_HTTP=true permits it"
                .to_owned()
        }
        line => line.to_owned(),
    }
}

/// An error and its causes.
fn chain(error: &Error) -> impl Iterator<Item = String> {
    let first: &(dyn std::error::Error + 'static) = error;
    std::iter::successors(Some(first), |error| (*error).source()).map(ToString::to_string)
}
