//! Values by path in a tree of JSON, and the order of its keys.

use std::fmt;

use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

/// The value at a path; `None` if a part of the path is switched off.
pub(super) fn find<'a>(tree: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(tree, |value, name| value.as_object()?.get(name))
}

/// The place of the value at a path.
pub(super) fn find_mut<'a>(tree: &'a mut Value, path: &str) -> Option<&'a mut Value> {
    path.split('.').try_fold(tree, |value, name| value.as_object_mut()?.get_mut(name))
}

/// The keys of a tree in the order in which they were written.
#[derive(Debug, Default)]
pub(super) struct KeyOrder(Vec<(String, KeyOrder)>);

/// No keys.
static NO_KEYS: KeyOrder = KeyOrder(Vec::new());

impl KeyOrder {
    /// The place of a key among its neighbours; the last one if it is not known.
    pub(super) fn place(&self, key: &str) -> usize {
        self.0.iter().position(|(name, _)| name == key).unwrap_or(self.0.len())
    }

    /// The keys below one.
    pub(super) fn below(&self, key: &str) -> &KeyOrder {
        self.0.iter().find(|(name, _)| name == key).map_or(&NO_KEYS, |(_, below)| below)
    }
}

impl<'de> Deserialize<'de> for KeyOrder {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(KeyVisitor)
    }
}

/// Takes the keys, and leaves the values.
struct KeyVisitor;

impl<'de> Visitor<'de> for KeyVisitor {
    type Value = KeyOrder;

    fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str("JSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<KeyOrder, A::Error> {
        let mut keys = KeyOrder::default();
        while let Some(entry) = map.next_entry()? {
            keys.0.push(entry);
        }
        Ok(keys)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<KeyOrder, A::Error> {
        while items.next_element::<IgnoredAny>()?.is_some() {}
        Ok(KeyOrder::default())
    }

    fn visit_bool<E>(self, _: bool) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }

    fn visit_u64<E>(self, _: u64) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }

    fn visit_i64<E>(self, _: i64) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }

    fn visit_f64<E>(self, _: f64) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }

    fn visit_str<E>(self, _: &str) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }

    fn visit_unit<E>(self) -> Result<KeyOrder, E> {
        Ok(KeyOrder::default())
    }
}
