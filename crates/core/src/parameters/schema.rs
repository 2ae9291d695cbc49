//! From the JSON schema that `schemars` derives from a struct to its parameters.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

use super::kind::{Choice, Limits, ParameterKind};
use super::parameter::Parameter;
use super::tree::KeyOrder;

/// The schema of a struct of parameters, without references.
pub fn schema_of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::default().with(|settings| settings.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().to_value()
}

/// Adds the parameters of a struct under a path, in the order of its fields as far as that is
/// known.
pub(super) fn add_parameters(
    schema: &Value,
    path: &str,
    order: &KeyOrder,
    found: &mut Vec<Parameter>,
) {
    let Some(fields) = schema["properties"].as_object() else { return };
    let mut names: Vec<&String> = fields.keys().collect();
    names.sort_by_key(|name| order.place(name));
    for name in names {
        let below = match path {
            "" => name.clone(),
            path => format!("{path}.{name}"),
        };
        let (field, order) = (&fields[name], order.below(name));
        found.extend(kind(field).map(|kind| parameter(&below, field, kind)));
        add_parameters(field, &below, order, found);
        for variant in variants(field) {
            let [(name, inner)] = &Vec::from_iter(variant)[..] else { continue };
            add_parameters(inner, &format!("{below}.{name}"), order.below(name), found);
        }
    }
}

fn parameter(path: &str, field: &Value, kind: ParameterKind) -> Parameter {
    let text = |key: &str| field[key].as_str().map(str::to_owned);
    let is_optional = types(field).any(|kind| kind == "null") && kind != ParameterKind::Switch;
    Parameter {
        path: path.to_owned(),
        doc: plain(&text("description").unwrap_or_default()),
        unit: text("unit"),
        source: text("source"),
        word_for_none: is_optional.then_some("auto"),
        is_unlimited: field["unlimited"] == true,
        kind,
    }
}

/// What the value of a field may be; `None` for a group of parameters that is always there.
fn kind(field: &Value) -> Option<ParameterKind> {
    let has_type = |name: &str| types(field).any(|kind| kind == name);
    if let Some(choices) = field["oneOf"].as_array() {
        return Some(ParameterKind::Choice { choices: choices.iter().map(choice).collect() });
    }
    let limits = limits(field);
    Some(match () {
        () if has_type("boolean") => ParameterKind::Flag,
        () if has_type("integer") => ParameterKind::Whole { limits },
        () if has_type("number") => ParameterKind::Number { limits },
        () if has_type("array") => {
            let length = field["prefixItems"].as_array().map(Vec::len);
            ParameterKind::List { length, limits }
        }
        () if has_type("null") => ParameterKind::Switch,
        () => return None,
    })
}

fn types(field: &Value) -> impl Iterator<Item = &str> {
    let several = field["type"].as_array().into_iter().flatten();
    several.chain(std::iter::once(&field["type"])).filter_map(Value::as_str)
}

fn limits(field: &Value) -> Limits {
    let is_list = types(field).any(|kind| kind == "array");
    let slider = field["slider"].as_array().map(|ends| [&ends[0], &ends[1]]);
    let slider = slider.and_then(|[from, to]| Some([from.as_f64()?, to.as_f64()?]));
    Limits {
        min: field["minimum"].as_f64().or(slider.filter(|_| is_list).map(|[from, _]| from)),
        max: field["maximum"].as_f64().or(slider.filter(|_| is_list).map(|[_, to]| to)),
        above: field["exclusiveMinimum"].as_f64(),
        below: field["exclusiveMaximum"].as_f64(),
        slider,
    }
}

/// The name and the meaning of a variant, with or without fields.
fn choice(variant: &Value) -> Choice {
    let with_fields = variant["properties"].as_object().and_then(|fields| fields.keys().next());
    let name = variant["const"].as_str().or(with_fields.map(String::as_str));
    Choice {
        name: name.unwrap_or_default().to_owned(),
        doc: plain(variant["description"].as_str().unwrap_or_default()),
    }
}

/// The fields of the variants of a choice.
fn variants(field: &Value) -> impl Iterator<Item = &Map<String, Value>> {
    let all = field["oneOf"].as_array().into_iter().flatten();
    all.filter_map(|variant| variant["properties"].as_object())
}

/// A doc comment as a line of text, without links.
fn plain(doc: &str) -> String {
    let mut text = doc.split_whitespace().collect::<Vec<_>>().join(" ");
    while let Some(start) = text.find("[`") {
        let Some(end) = text[start..].find("`]").map(|end| start + end) else { break };
        let name = text[start + 2..end].to_owned();
        let rest = &text[end + 2..];
        let target = rest.starts_with('(').then(|| rest.find(')')).flatten();
        let after = end + 2 + target.map_or(0, |close| close + 1);
        text.replace_range(start..after, &format!("`{name}`"));
    }
    text
}
