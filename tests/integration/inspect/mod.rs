//! The inspector: what it answers, to whom, and that nothing in a recording does harm.

mod cases;
mod surveys;
mod without_classes;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;

use divmerge::annotate::{AnnotateConfig, cluster};
use divmerge::frames::{CloudAt, TruthSource, encoded_cloud_at};
use divmerge::inspect::{Asked, Gate, Reply, Server, Session, SessionOptions, reply};
use serde_json::{Value, json};

use crate::cli::{divmerge, path, text};
use crate::hostile::recording;
use crate::recordings::drive;

const HOST: &str = "127.0.0.1:4711";

fn options(input: &Path) -> SessionOptions {
    SessionOptions {
        input: input.to_owned(),
        topic: None,
        frame: 0,
        config: AnnotateConfig::default(),
        truth: TruthSource::default(),
        is_truth_said: false,
        words: Vec::new(),
        command_line: |words| words.join(" "),
    }
}

/// A session and its gate.
struct Desk {
    session: Arc<Session>,
    gate: Gate,
}

impl Desk {
    fn of(input: &Path) -> Self {
        Desk::with(options(input))
    }

    fn with(options: SessionOptions) -> Self {
        let session = Session::open(options).expect("a session");
        let gate = Gate::new(HOST.parse().unwrap()).expect("random numbers");
        Desk { session: Arc::new(session), gate }
    }

    fn asked(&self, path: &str, body: Option<&Value>) -> Reply {
        let address = self.gate.address();
        let root = address.strip_prefix(&format!("http://{HOST}")).expect("the host");
        reply(
            &self.session,
            &self.gate,
            &Asked {
                is_post: body.is_some(),
                path: format!("{root}{path}"),
                host: Some(HOST.into()),
                body: body.map(|body| body.to_string().into_bytes()).unwrap_or_default(),
                ..Asked::default()
            },
        )
    }

    /// The answer in JSON to a request that is right.
    fn answer(&self, path: &str, body: &Value) -> Value {
        let Reply { status, body, .. } = self.asked(path, Some(body));
        assert_eq!(status, 200, "{path}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("JSON")
    }

    /// Status and words of an answer to a request that is wrong.
    fn problem(&self, path: &str, body: &Value) -> (u16, String) {
        let Reply { status, body, .. } = self.asked(path, Some(body));
        let words: Value = serde_json::from_slice(&body).expect("JSON");
        (status, words["problem"].as_str().expect("a problem").to_owned())
    }

    /// What a survey found, once it is over.
    fn survey(&self) -> Value {
        loop {
            let state = self.answer("api/survey-state", &json!({}));
            if state["is_over"] == true {
                return state;
            }
            std::thread::yield_now();
        }
    }

    fn looked_through(&self, survey: &Value) -> Value {
        self.answer("api/survey", survey);
        self.survey()
    }

    fn topic(&self) -> Value {
        self.answer("api/session", &json!({}))["topic"].clone()
    }

    /// A request about frame 0, with more.
    fn frame(&self, more: Value) -> Value {
        let mut body = json!({ "topic": self.topic(), "frame": 0 });
        for (name, value) in more.as_object().expect("an object") {
            body[name] = value.clone();
        }
        body
    }
}

/// Two points of the largest instance, as far apart in the cloud as they can be.
fn points_of_largest(instance: &[u32]) -> [usize; 2] {
    let of = |id: u32| instance.iter().filter(|&&own| own == id).count();
    let largest = (1..=instance.iter().copied().max().unwrap_or(0)).max_by_key(|&id| of(id));
    let is_it = |own: &u32| Some(*own) == largest;
    let first = instance.iter().position(is_it).expect("a point");
    [first, instance.iter().rposition(is_it).expect("a point")]
}

/// The header of a picture, and one of its arrays of 32 bits.
fn unpacked(bytes: &[u8], array: &str) -> (Value, Vec<u32>) {
    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("a header");
    let all = header["arrays"].as_array().expect("arrays");
    let found = all.iter().find(|one| one["name"] == array).expect("the array");
    let at = 4 + length + found["at"].as_u64().unwrap() as usize;
    let count = found["length"].as_u64().unwrap() as usize;
    let words = bytes[at..at + 4 * count].chunks_exact(4);
    let words = words.map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
    (header, words)
}

#[test]
fn a_picture_is_the_clustering_of_its_frame() {
    let (_folder, input) = drive(3);
    let desk = Desk::of(&input);
    let reply = desk.asked("api/frame", Some(&desk.frame(json!({ "with_points": true }))));
    assert_eq!((reply.status, reply.content_type), (200, "application/octet-stream"));
    let (header, instance) = unpacked(&reply.body, "instance");

    let message = encoded_cloud_at(&input, None, CloudAt::Frame(0), None).unwrap();
    let wire = message.decode().unwrap();
    let expected = cluster(&wire, &message.key(&wire), &AnnotateConfig::default()).unwrap();
    assert_eq!(instance, expected.stages.labels.instance);
    assert_eq!(header["cloud"]["points"], expected.cloud.len());
    let instances = header["run"]["instances"].as_array().unwrap();
    assert_eq!(instances.len(), expected.stages.instances.len());
    assert!(!instances.is_empty() && instances[0]["title"] == expected.stages.instances[0].title());
    let (_, x) = unpacked(&reply.body, "position");
    let bits = |point: usize| expected.cloud.position(point).map(f32::to_bits);
    assert!((0..expected.cloud.len()).all(|point| x[3 * point..3 * point + 3] == bits(point)));

    // Without the points it is the run alone.
    let again = desk.asked("api/frame", Some(&desk.frame(json!({}))));
    assert!(again.body.len() < reply.body.len());
    assert_eq!(unpacked(&again.body, "instance").1, instance);
}

#[test]
fn an_explanation_is_that_of_explain() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    let picture = desk.asked("api/frame", Some(&desk.frame(json!({}))));
    let (_, instance) = unpacked(&picture.body, "instance");
    let one = |id: u32| instance.iter().position(|&own| own == id).expect("a point");
    let points = json!({ "points": [one(1), one(2)] });
    let found = desk.answer("api/explain", &desk.frame(points.clone()));
    let at: Vec<&str> = found["at"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let command = ["explain", path(&input), "--no-what-if", "--at", at[0], "--at", at[1]];
    let printed = divmerge(&command);
    assert_eq!(found["text"], text(&printed.stdout), "{command:?}");
    let printed = divmerge(&[&command[..], &["--json"]].concat());
    let report: Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert_eq!(found["report"], report);

    let words = json!({ "points": [one(1), one(2)], "command": "explain" });
    let command = desk.answer("api/command", &desk.frame(words));
    let command = command["command"].as_str().unwrap();
    assert!(command.contains(&format!("--at {} --at {}", at[0], at[1])), "{command}");
}

/// The first and the last point of instance 1.
fn ends_of_one(desk: &Desk) -> Value {
    let picture = desk.asked("api/frame", Some(&desk.frame(json!({}))));
    let (_, instance) = unpacked(&picture.body, "instance");
    let of_one = || (0..instance.len()).filter(|&point| instance[point] == 1);
    json!([of_one().next(), of_one().next_back()])
}

#[test]
fn each_change_gives_the_other_answer() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    let points = ends_of_one(&desk);
    let found = desk.answer("api/changes", &desk.frame(json!({ "points": points })));
    let changes = found["changes"].as_array().unwrap();
    assert!(!changes.is_empty(), "{}", found["text"]);
    for change in changes {
        let setting = json!({ "set": change["set"] });
        let request = desk.frame(json!({ "points": points, "setting": setting }));
        let changed = desk.answer("api/explain", &request);
        assert_ne!(changed["report"]["answer"], found["report"]["answer"], "{change}");
    }
}

#[test]
fn two_settings_are_compared() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    let compared = |second: Value| {
        let body = json!({ "topic": desk.topic(), "frame": 0, "first": {}, "second": second });
        desk.answer("api/compare", &body)
    };
    assert_eq!(compared(json!({}))["differences"], json!([]));
    let apart = compared(json!({ "preset": "paper" }));
    assert!(!apart["differences"].as_array().unwrap().is_empty());
    let counted: u64 =
        apart["counts"].as_array().unwrap().iter().filter_map(|one| one[1].as_u64()).sum();
    assert_eq!(counted, apart["differences"].as_array().unwrap().len() as u64);
}

#[test]
fn what_is_wrong_is_said() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    let wrong = |path: &str, more: Value| desk.problem(path, &desk.frame(more));
    let (status, words) = wrong("api/frame", json!({ "frame": 2 }));
    assert!(status == 422 && words.contains("has 2 clouds, numbered 0 to 1"), "{status} {words}");
    let (status, words) = wrong("api/frame", json!({ "topic": "/nothing" }));
    assert!(status == 422 && words.contains("/nothing"), "{status} {words}");
    let unknown = json!({ "setting": { "set": { "cluster.voxle": 1 } } });
    let (_, words) = wrong("api/frame", unknown);
    assert!(words.contains("cluster.voxle"), "{words}");
    for setting in [json!({ "preset": "bets" }), json!({ "method": "magic" }), json!({ "x": 1 })] {
        let (status, words) = wrong("api/frame", json!({ "setting": setting }));
        assert!(status >= 400, "{status} {words}");
    }
    for points in [json!([]), json!([0, 0]), json!([0, 1, 2]), json!([999_999_999])] {
        let (status, words) = wrong("api/explain", json!({ "points": points }));
        assert_eq!(status, 400, "{words}");
    }
    assert_eq!(desk.asked("api/frame", Some(&json!("no object"))).status, 400);
    assert_eq!(desk.asked("api/frame", None).status, 404);
}

#[test]
fn no_file_of_the_machine_is_served() {
    let (_folder, input) = drive(2);
    let desk = Desk::of(&input);
    assert_eq!(desk.asked("", None).content_type, "text/html; charset=utf-8");
    assert_eq!(desk.asked("page/main.js", None).status, 200);
    let own = path(&input);
    for other in [
        "page/../Cargo.toml",
        "page/%2e%2e/Cargo.toml",
        "page//etc/passwd",
        "../etc/passwd",
        "/etc/passwd",
        "etc/passwd",
        own,
        "api/../page/main.js",
        "page/",
        "page/index.html",
    ] {
        assert_eq!(desk.asked(other, None).status, 404, "{other}");
        assert_ne!(desk.asked(other, Some(&json!({}))).status, 200, "{other}");
    }
}

/// What a server replies to bytes.
fn sent(address: &str, request: &str) -> String {
    let host = address.strip_prefix("http://").unwrap().split('/').next().unwrap();
    let mut connection = TcpStream::connect(host).expect("a server");
    connection.write_all(request.as_bytes()).expect("a request");
    connection.shutdown(std::net::Shutdown::Write).expect("an end");
    let mut reply = String::new();
    connection.read_to_string(&mut reply).expect("a reply in text");
    reply
}

#[test]
fn a_server_answers_its_own_page_alone() {
    let (_folder, input) = drive(2);
    let session = Arc::new(Session::open(options(&input)).unwrap());
    for outside in ["0.0.0.0:0", "192.0.2.1:0", "[::]:0"] {
        let refused = Server::start(Arc::clone(&session), outside.parse().unwrap());
        let problem = refused.err().expect("an error").to_string();
        assert!(problem.contains("this machine alone"), "{problem}");
    }
    let server = Server::start(session, "127.0.0.1:0".parse().unwrap()).unwrap();
    let address = server.address();
    let (host, path) = address["http://".len()..].split_once('/').unwrap();
    let get = |path: &str, headers: &str| {
        sent(&address, &format!("GET /{path} HTTP/1.1\r\n{headers}\r\n"))
    };
    let status = |reply: &str| reply[9..12].to_owned();
    let own = format!("Host: {host}\r\n");
    let page = get(path, &own);
    assert_eq!(status(&page), "200");
    for header in ["X-Frame-Options: DENY", "Referrer-Policy: no-referrer", "no-store"] {
        assert!(page.contains(header), "{header}");
    }
    assert!(!page.contains("Access-Control-Allow"));
    assert_eq!(status(&get("", &own)), "404");
    assert_eq!(status(&get(&path.replace('/', "x/"), &own)), "404");
    assert_eq!(status(&get(path, "Host: evil.example\r\n")), "421");
    assert_eq!(status(&get(path, "")), "421");
    assert_eq!(status(&get(path, &format!("{own}Origin: http://evil.example\r\n"))), "403");
    assert_eq!(status(&get(path, &format!("{own}Sec-Fetch-Site: cross-site\r\n"))), "403");
    assert_eq!(status(&sent(&address, "\x16\x03\x01 hello\r\n\r\n")), "400");
    let post = format!("POST /{path}api/session HTTP/1.1\r\n{own}Content-Length: 2\r\n\r\n{{}}");
    assert_eq!(status(&sent(&address, &post)), "200");
    let closed = address.clone();
    drop(server);
    let host = closed["http://".len()..].split('/').next().unwrap();
    assert!(TcpStream::connect(host).is_err(), "it still listens");
}

#[test]
fn names_and_points_of_a_recording_do_no_harm() {
    const MARKUP: &str = "/a\"><script>alert(1)</script>\u{202e}\u{1b}[2J";
    let wild = [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, 0.0, -0.0, 1e30, 3.0];
    let points: Vec<[f32; 3]> = (0..200).map(|n| [0, 3, 5].map(|by| wild[(n + by) % 8])).collect();
    for points in [&points[..], &[], &[[f32::NAN; 3]; 50]] {
        let (_folder, input) = recording(MARKUP, MARKUP, points);
        let desk = Desk::of(&input);
        let facts = desk.answer("api/session", &json!({}));
        assert_eq!(facts["topic"], MARKUP);
        let reply = desk.asked("api/frame", Some(&desk.frame(json!({ "with_points": true }))));
        assert_eq!(reply.status, 200);
        assert_eq!(unpacked(&reply.body, "instance").1.len(), points.len());
        let survey = json!({ "topic": MARKUP, "frames": [0, 1] });
        assert_eq!(desk.asked("api/survey", Some(&survey)).status, 200);
        let case = desk.asked("api/case", Some(&desk.frame(json!({}))));
        let page = String::from_utf8(case.body).unwrap();
        assert!(case.status == 200 && !page.contains("<script>alert"), "{}", case.status);
        let figure = json!({ "figure": { "format": "svg", "dark": true } });
        let figure = desk.asked("api/figure", Some(&desk.frame(figure)));
        assert!(!String::from_utf8_lossy(&figure.body).contains("<script>"));
    }
}

#[test]
fn a_recording_without_clouds_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty.mcap");
    std::fs::write(&empty, b"no recording").unwrap();
    assert!(Session::open(options(&empty)).is_err());
    let printed = divmerge(&["inspect", path(&empty), "--no-open"]);
    assert!(!printed.status.success() && text(&printed.stdout).is_empty());
    let printed = divmerge(&["inspect", path(&empty), "--no-open", "--listen", "0.0.0.0:80"]);
    assert_eq!(printed.status.code(), Some(2));
    assert!(text(&printed.stderr).contains("this machine alone"));
}

#[test]
fn a_frame_that_is_not_there_is_refused() {
    let (_folder, input) = drive(2);
    let done = divmerge(&["inspect", path(&input), "--frame", "2", "--no-open"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(text(&done.stderr).contains("numbered 0 to 1"), "{}", text(&done.stderr));
}

#[test]
fn the_folder_of_a_bag_is_its_first_file() {
    let (folder, input) = drive(2);
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    for name in ["bag_0.mcap", "bag_1.mcap"] {
        std::fs::copy(&input, bag.join(name)).unwrap();
    }
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  \
                    relative_file_paths: [bag_0.mcap, bag_1.mcap]\n";
    std::fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    // It gets as far as the frame that is not there.
    let done = divmerge(&["inspect", path(&bag), "--frame", "2", "--no-open"]);
    let said = text(&done.stderr);
    assert!(said.contains("bag_0.mcap") && said.contains("numbered 0 to 1"), "{said}");
    assert!(said.contains("name it: bag_1.mcap"), "{said}");
}
