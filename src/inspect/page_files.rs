//! The files of the page. They are within the binary, and the browser loads modules as they are.
//!
//! A build for development (with debug assertions) reads them from the folder that
//! `DIVMERGE_INSPECT_PAGE` names, so that a change of the page needs no build.

use std::borrow::Cow;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

const INDEX: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/inspect.css");

/// The modules by name; the first starts the page.
const MODULES: &[(&str, &str)] = &[
    ("main", include_str!("page/main.js")),
    ("source", include_str!("page/source.js")),
    ("state", include_str!("page/state.js")),
    ("colours", include_str!("page/colours.js")),
    ("camera", include_str!("page/camera.js")),
    ("scene", include_str!("page/scene.js")),
    ("rasterizer", include_str!("page/rasterizer.js")),
    ("overlay", include_str!("page/overlay.js")),
    ("views", include_str!("page/views.js")),
    ("pointing", include_str!("page/pointing.js")),
    ("parameters", include_str!("page/parameters.js")),
    ("figures", include_str!("page/figures.js")),
    ("nodes", include_str!("page/nodes.js")),
    ("why", include_str!("page/why.js")),
    ("side_list", include_str!("page/side_list.js")),
    ("take_along", include_str!("page/take_along.js")),
    ("keys", include_str!("page/keys.js")),
    ("dom", include_str!("page/dom.js")),
];

/// How a page loads what it needs.
enum Loading<'a> {
    /// From the server, file by file.
    Served,
    /// From itself, with the data of a case.
    Within(&'a str),
}

/// The page as the server gives it.
pub(super) fn document() -> String {
    filled(Loading::Served)
}

/// The page as one file that opens without a server, with the data of a case as JSON.
pub(super) fn case_document(case: &str) -> String {
    filled(Loading::Within(case))
}

/// A file that the page loads: its type and its text.
pub(super) fn asset(name: &str) -> Option<(&'static str, Cow<'static, str>)> {
    if name == "inspect.css" {
        return Some(("text/css; charset=utf-8", text("inspect.css", STYLE)));
    }
    let module = name.strip_suffix(".js")?;
    let (_, own) = MODULES.iter().find(|(known, _)| *known == module)?;
    Some(("text/javascript; charset=utf-8", text(name, own)))
}

#[cfg(not(debug_assertions))]
fn text(_name: &str, own: &'static str) -> Cow<'static, str> {
    Cow::Borrowed(own)
}

/// Names are of this file alone, and never of a request.
#[cfg(debug_assertions)]
fn text(name: &str, own: &'static str) -> Cow<'static, str> {
    let folder = std::env::var_os("DIVMERGE_INSPECT_PAGE");
    let read = folder
        .and_then(|folder| std::fs::read_to_string(std::path::Path::new(&folder).join(name)).ok());
    read.map_or(Cow::Borrowed(own), Cow::Owned)
}

fn filled(loading: Loading) -> String {
    let address = |name: &str, own: &'static str| match loading {
        Loading::Served => format!("./page/{name}.js"),
        Loading::Within(_) => {
            let text = text(&format!("{name}.js"), own);
            format!("data:text/javascript;base64,{}", BASE64.encode(&*text))
        }
    };
    let modules = MODULES
        .iter()
        .map(|(name, own)| (format!("inspect/{name}"), Value::String(address(name, own))));
    let map = serde_json::json!({ "imports": modules.collect::<Map<String, Value>>() });
    let (style, case) = match loading {
        Loading::Served => {
            ("<link rel=\"stylesheet\" href=\"./page/inspect.css\">".into(), "null".into())
        }
        Loading::Within(case) => {
            (format!("<style>\n{}</style>", text("inspect.css", STYLE)), case.to_owned())
        }
    };
    let map = within_script(&map.to_string());
    let (start, own) = MODULES[0];
    text("index.html", INDEX)
        .replace("{{policy}}", &policy(&loading, &map))
        .replace("{{style}}", &style)
        .replace("{{start}}", &address(start, own))
        .replace("{{modules}}", &map)
        .replace("{{case}}", &within_script(&case))
}

/// What a page may load. One that is served runs its own modules, and within itself the map of
/// their names alone; a case has everything within and may load nothing at all.
fn policy(loading: &Loading, map: &str) -> String {
    let scripts = match loading {
        Loading::Served => {
            let digest = BASE64.encode(Sha256::digest(map));
            format!("script-src 'self' 'sha256-{digest}'; connect-src 'self'; style-src 'self'")
        }
        Loading::Within(_) => {
            "script-src 'unsafe-inline' data:; style-src 'unsafe-inline'".to_owned()
        }
    };
    format!(
        "default-src 'none'; {scripts}; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
}

/// JSON as it can stand within an element of scripts: nothing in it ends the element.
fn within_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn nothing_is_loaded_from_elsewhere() {
        let case = json!({ "name": "</script><script>alert(1)</script>" });
        for page in [document(), case_document(&case.to_string())] {
            assert!(!page.contains("{{"), "a place was not filled");
            assert!(!page.contains("https://") && !page.contains("</script><script>alert"));
        }
        for (name, module) in MODULES {
            let addresses = ["http://", "https://", "import("];
            assert!(!addresses.iter().any(|address| module.contains(address)), "{name}");
        }
    }

    #[test]
    fn modules_name_each_other_and_all_are_there() {
        for (name, module) in MODULES {
            for import in module.split("from \"").skip(1) {
                let import = import.split('"').next().unwrap_or_default();
                let known = import.strip_prefix("inspect/");
                let is_there = MODULES.iter().any(|(other, _)| Some(*other) == known);
                assert!(is_there, "{name} imports {import}");
            }
        }
        assert!(asset("main.js").is_some() && asset("inspect.css").is_some());
        for other in ["", "main", "../main.js", "main.js/", "index.html", "/etc/passwd"] {
            assert!(asset(other).is_none(), "{other}");
        }
    }
}
