//! A browser without a window, spoken to through two pipes: the DevTools protocol.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::env;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;

/// No network but this machine's, nothing of the user's, drawing in software.
const FLAGS: [&str; 13] = [
    "--headless",
    "--no-sandbox",
    "--remote-debugging-pipe",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--mute-audio",
];

/// A browser with one page.
pub struct Browser {
    process: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: Option<String>,
    asked: u64,
    is_loaded: bool,
    /// Whom the page has asked for something.
    pub requests: Vec<String>,
    /// What the page has complained of.
    pub complaints: Vec<String>,
    _profile: TempDir,
}

impl Browser {
    /// Opens a page of this size at this address. It leaves the processor to whoever else wants it.
    pub fn open(address: &str, width: u32, height: u32) -> Self {
        let profile = tempfile::tempdir().expect("a folder");
        let program = env::var_os("MIKOSHI_BROWSER").unwrap_or_else(|| OsString::from("chromium"));
        // A browser reads at descriptor 3 and answers at 4.
        let script = "exec nice -n 10 \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1";
        let mut process = Command::new("sh")
            .args(["-c", script])
            .arg(program)
            .args(FLAGS)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("--window-size={width},{height}"))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("sh can be started");
        let to = process.stdin.take().expect("it was asked for");
        let from = BufReader::new(process.stdout.take().expect("it was asked for"));
        let mut browser = Self {
            process,
            to,
            from,
            session: None,
            asked: 0,
            is_loaded: false,
            requests: vec![],
            complaints: vec![],
            _profile: profile,
        };
        let targets = browser.ask("Target.getTargets", &json!({}));
        let mut targets = targets["targetInfos"].as_array().expect("a list").iter();
        let page = targets.find(|target| target["type"] == "page").expect("a page");
        let attach = json!({ "targetId": page["targetId"], "flatten": true });
        let session = browser.ask("Target.attachToTarget", &attach)["sessionId"].clone();
        browser.session = Some(session.as_str().expect("a name").to_owned());
        for domain in ["Network.enable", "Page.enable", "Log.enable", "Runtime.enable"] {
            browser.ask(domain, &json!({}));
        }
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.ask("Emulation.setDeviceMetricsOverride", &size);
        browser.ask("Page.navigate", &json!({ "url": address }));
        while !browser.is_loaded {
            let event = browser.hear();
            browser.note(&event);
        }
        browser
    }

    /// What the page looks like now.
    pub fn picture(&mut self) -> Picture {
        let answer = self.ask("Page.captureScreenshot", &json!({ "format": "png" }));
        let data = answer["data"].as_str().expect("a picture");
        Picture::decode(STANDARD.decode(data).expect("as the protocol has it"))
    }

    /// Asks, and waits for the answer.
    fn ask(&mut self, method: &str, parameters: &Value) -> Value {
        self.asked += 1;
        let mut question = json!({ "id": self.asked, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            question["sessionId"] = json!(session);
        }
        let mut bytes = question.to_string().into_bytes();
        bytes.push(0);
        self.to.write_all(&bytes).expect("the browser reads: is `chromium` installed?");
        loop {
            let message = self.hear();
            if message["id"] == self.asked {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].clone();
            }
            self.note(&message);
        }
    }

    /// The next thing that it says.
    fn hear(&mut self) -> Value {
        let mut message = vec![];
        let length = self.from.read_until(0, &mut message).expect("the browser answers");
        assert!(length > 1, "the browser has ended: is `chromium` installed?");
        serde_json::from_slice(&message[..length - 1]).expect("JSON")
    }

    fn note(&mut self, event: &Value) {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        match event["method"].as_str() {
            Some("Network.requestWillBeSent") => {
                self.requests.push(text(&event["params"]["request"]["url"]));
            }
            // The empty page that it begins with is loaded before anybody listens.
            Some("Page.loadEventFired") => self.is_loaded = true,
            Some("Log.entryAdded") => self.complaints.push(text(&event["params"]["entry"]["text"])),
            Some("Runtime.exceptionThrown") => {
                self.complaints.push(text(&event["params"]["exceptionDetails"]));
            }
            _ => {}
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // In order, so that it takes its helpers with it; whoever does not listen is killed.
        let close = json!({ "id": 0, "method": "Browser.close" }).to_string();
        if self.to.write_all(close.as_bytes()).and_then(|()| self.to.write_all(&[0])).is_err() {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}

/// A picture of a page.
pub struct Picture {
    pub width: usize,
    /// Rows from above: red, green and blue of each pixel.
    rgb: Vec<u8>,
    /// As a file.
    pub png: Vec<u8>,
}

impl Picture {
    fn decode(file: Vec<u8>) -> Self {
        let decoder = png::Decoder::new(std::io::Cursor::new(&file));
        let mut reader = decoder.read_info().expect("a PNG file");
        let mut bytes = vec![0; reader.output_buffer_size().expect("it is small")];
        let info = reader.next_frame(&mut bytes).expect("it is whole");
        let rgb = match info.color_type {
            png::ColorType::Rgb => bytes,
            png::ColorType::Rgba => {
                bytes.chunks(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
            }
            other => panic!("{other:?}"),
        };
        Self { width: info.width as usize, rgb, png: file }
    }

    /// Every pixel, by column and row from the upper left corner.
    pub fn pixels(&self) -> impl Iterator<Item = ((usize, usize), [u8; 3])> {
        let pixels = self.rgb.chunks(3).enumerate();
        pixels
            .map(|(index, pixel)| ((index % self.width, index / self.width), [pixel[0], pixel[1], pixel[2]]))
    }
}
