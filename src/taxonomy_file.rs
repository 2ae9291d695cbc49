//! Taxonomies from YAML files in semantic-kitti-api's form.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::error::{Error, Result};
use divmerge_core::cloud::taxonomy::{Class, Taxonomy};

/// The parts of semantic-kitti-api's file that are used here.
#[derive(Deserialize)]
struct File {
    labels: BTreeMap<u16, String>,
    #[serde(default)]
    learning_map: BTreeMap<u16, u16>,
    #[serde(default)]
    learning_map_inv: BTreeMap<u16, u16>,
    #[serde(default)]
    learning_ignore: BTreeMap<u16, bool>,
    #[serde(default)]
    thing_class: Option<BTreeMap<u16, bool>>,
}

/// The known taxonomy of a name ([`Taxonomy::known`]), else that of a YAML file in
/// semantic-kitti-api's form (`labels`, `learning_map`, `learning_map_inv`,
/// `learning_ignore`). Things are those under `thing_class` (class to true or false) if the file
/// has that map, else the classes with the names of movable objects that the field's data sets use.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Taxonomy`] if it is not such a file or has no
/// thing.
pub fn read_taxonomy(path: &Path) -> Result<Taxonomy> {
    if let Some(known) = path.to_str().and_then(Taxonomy::named) {
        return Ok(known.clone());
    }
    let text =
        std::fs::read_to_string(path).map_err(|source| Error::Io { path: path.into(), source })?;
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    parse(&name.unwrap_or_default(), &text)
        .map_err(|problem| Error::Taxonomy { path: path.into(), problem })
}

fn parse(name: &str, text: &str) -> std::result::Result<Taxonomy, String> {
    let mut file: File = serde_saphyr::from_str(text).map_err(|error| error.to_string())?;
    if file.labels.is_empty() {
        return Err("`labels` is empty".into());
    }
    if file.learning_map.is_empty() {
        file.learning_map = file.labels.keys().map(|&id| (id, id)).collect();
    }
    let class_count = file.learning_map.values().max().map_or(0, |&last| last as usize) + 1;
    let classes: Vec<Class> = (0..class_count as u16).map(|class| file.class(class)).collect();
    if !classes.iter().any(|class| class.is_thing) {
        return Err("no class is a thing: add a map `thing_class` (class: true)".into());
    }
    Ok(Taxonomy::new(name, classes, file.learning_map).with_ids(file.learning_map_inv))
}

impl File {
    fn class(&self, class: u16) -> Class {
        let folded = || self.learning_map.iter().find(|&(_, &to)| to == class).map(|(&id, _)| id);
        let raw = self.learning_map_inv.get(&class).copied().or_else(folded);
        let name = raw.and_then(|id| self.labels.get(&id)).cloned();
        let name = name.unwrap_or_else(|| format!("class {class}"));
        let is_thing = match &self.thing_class {
            Some(things) => things.get(&class).copied().unwrap_or(false),
            None => Class::is_thing_name(&name),
        };
        let is_ignored = self.learning_ignore.get(&class).copied().unwrap_or(false);
        Class { is_ignored: class == 0 || is_ignored, is_thing: is_thing && class != 0, name }
    }
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn yaml_in_semantic_kitti_form() {
        let text = "
labels: {0: unlabeled, 10: car, 40: road, 252: moving-car}
color_map: {10: [245, 150, 100]}
learning_map: {0: 0, 10: 1, 252: 1, 40: 2}
learning_map_inv: {0: 0, 1: 10, 2: 40}
learning_ignore: {0: true, 1: false, 2: false}
";
        let taxonomy = parse("mine", text).unwrap();
        assert_eq!(taxonomy.class_of(252), Some(1));
        assert!(taxonomy.classes()[1].is_thing && !taxonomy.classes()[2].is_thing);
        assert_eq!(taxonomy.classes()[2].name, "road");
        let other_way = text.replace("1: 10, 2: 40}", "1: 252, 2: 40}") + "thing_class: {1: true}";
        assert_eq!(taxonomy.id_of(1), Some(10));
        assert_eq!(parse("mine", &other_way).unwrap().id_of(1), Some(252));
        let with_things = format!("{text}thing_class: {{2: true}}\n");
        let taxonomy = parse("mine", &with_things).unwrap();
        assert!(!taxonomy.classes()[1].is_thing && taxonomy.classes()[2].is_thing);
    }

    #[test]
    fn yaml_that_is_something_else_is_refused() {
        assert!(parse("x", "a: 1").is_err());
        assert!(parse("x", "labels: {0: road}").is_err());
    }
}
