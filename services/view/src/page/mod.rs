//! The page: Rerun's viewer as it comes with its crate, on this machine only.
//!
//! Rerun's own page fetches fonts and counts visits elsewhere. This one has what the viewer needs, and forbids the
//! browser to ask anybody else.

use crate::outlet::LOOK;
use mikoshi::failure::Failure;
use mikoshi::interrupts::Interrupts;
use re_grpc_server::ServerOptions;
use re_sdk::{RecordingStream, RecordingStreamBuilder};
use re_web_viewer_server::WebViewerData;
use std::io::Cursor;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;
use tiny_http::{Header, Request, Response, Server, StatusCode};

const HOST: Ipv4Addr = Ipv4Addr::LOCALHOST;
const DEFAULT_PORT: u16 = 9090;
/// A browser that takes nothing keeps one of them.
const THREADS: usize = 4;

/// A page that shows what one stream says.
pub struct Page {
    address: String,
    data_port: u16,
}

/// What browsers are handed.
struct Content {
    page: String,
    rules: String,
    viewer: WebViewerData,
}

impl Page {
    /// Serves it at this port, and its data at the next one; where none is asked for and the default is taken, at any.
    ///
    /// # Errors
    /// The port is taken.
    pub fn open(port: Option<u16>, title: &str) -> Result<Self, Failure> {
        let opened = match port {
            Some(port) => bind(port),
            None => bind(DEFAULT_PORT).or_else(|_| bind(0)),
        };
        let (listener, data) = opened.map_err(|error| {
            let port = port.unwrap_or(DEFAULT_PORT);
            Failure::fault(error).context(format!("no page at port {port}, or no data at the next one"))
        })?;
        let port = |listener: &TcpListener| listener.local_addr().map(|address| address.port());
        let (page_port, data_port) =
            (port(&listener).map_err(Failure::fault)?, port(&data).map_err(Failure::fault)?);
        let content = Arc::new(Content {
            page: include_str!("page.html")
                .replace("TITLE", &title.replace(['<', '>', '&', '"'], "_"))
                .replace("DATA_PORT", &data_port.to_string()),
            rules: rules(data_port),
            viewer: WebViewerData::load(None).map_err(Failure::fault)?,
        });
        let server =
            Server::from_listener(listener, None).map_err(|error| Failure::fault(error.to_string()))?;
        let server = Arc::new(server);
        for _ in 0..THREADS {
            let (server, content) = (Arc::clone(&server), Arc::clone(&content));
            thread::spawn(move || server.incoming_requests().for_each(|request| content.answer(request)));
        }
        // The stream takes its place.
        drop(data);
        Ok(Self { address: format!("http://{HOST}:{page_port}/"), data_port })
    }

    /// Where it is.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The stream that the page shows.
    ///
    /// # Errors
    /// Its port was taken meanwhile.
    pub fn serve(&self, builder: RecordingStreamBuilder) -> Result<RecordingStream, Failure> {
        let stream = builder
            .serve_grpc_opts(HOST.to_string(), self.data_port, ServerOptions::default())
            .map_err(Failure::fault)?;
        // Its server starts in a thread of its own, which can't say that it failed.
        for _ in 0..100 {
            if TcpStream::connect((HOST, self.data_port)).is_ok() {
                return Ok(stream);
            }
            thread::park_timeout(LOOK);
        }
        Err(Failure::fault(format!("port {} can't be listened at", self.data_port)))
    }

    /// Stays until somebody interrupts.
    pub fn stay(&self, interrupts: &Interrupts) {
        while interrupts.received().is_none() {
            thread::park_timeout(LOOK);
        }
    }
}

/// A place for a page, and one for its data.
fn bind(port: u16) -> std::io::Result<(TcpListener, TcpListener)> {
    let data_port = if port == 0 { 0 } else { port.saturating_add(1) };
    Ok((TcpListener::bind((HOST, port))?, TcpListener::bind((HOST, data_port))?))
}

/// Whom the page may ask, and what it may run.
fn rules(data_port: u16) -> String {
    format!(
        "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; \
         img-src 'self' data: blob:; connect-src 'self' blob: http://{HOST}:{data_port}; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'"
    )
}

impl Content {
    fn answer(&self, request: Request) {
        let path = request.url().split('?').next().unwrap_or_default();
        let (kind, bytes) = match path {
            "/" => ("text/html; charset=utf-8", self.page.as_bytes()),
            "/start.js" => ("text/javascript", include_bytes!("start.js").as_slice()),
            "/re_viewer.js" => ("text/javascript", self.viewer.viewer_js()),
            "/re_viewer_bg.wasm" => ("application/wasm", self.viewer.viewer_wasm()),
            "/favicon.ico" => ("image/x-icon", self.viewer.favicon()),
            _ => ("text/plain", b"".as_slice()),
        };
        let status = StatusCode(if bytes.is_empty() { 404 } else { 200 });
        let headers = [
            ("Content-Type", kind),
            ("Content-Security-Policy", self.rules.as_str()),
            ("Referrer-Policy", "no-referrer"),
            ("Cache-Control", "no-cache"),
        ];
        let headers = headers.iter().filter_map(|(name, value)| Header::from_bytes(*name, *value).ok());
        let response = Response::new(status, headers.collect(), Cursor::new(bytes), Some(bytes.len()), None)
            .with_chunked_threshold(usize::MAX);
        // A browser that has gone wants no answer.
        let _ = request.respond(response);
    }
}
