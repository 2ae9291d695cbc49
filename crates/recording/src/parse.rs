//! Records parsed by `mcap`, once their lengths have been seen to fit.
//!
//! `mcap` makes room for as many bytes as a length claims before it reads them: four gigabytes for
//! a name in a record of twenty bytes.

use mcap::records::{Record, op};

use crate::damage::Damage;
use crate::fields::Fields;
use crate::names::record_name;

/// Parses the content of a record.
///
/// # Errors
/// [`Damage::Unreadable`] if it is not what its opcode says.
pub(crate) fn parse_record(opcode: u8, body: &[u8]) -> Result<Record<'_>, Damage> {
    let parsed = fit(opcode, Fields(body)).and_then(|()| mcap::parse_record(opcode, body).ok());
    parsed.ok_or(Damage::Unreadable { record: record_name(opcode) })
}

/// Checks everything in the record that has a length of its own.
fn fit(opcode: u8, mut fields: Fields) -> Option<()> {
    match opcode {
        op::HEADER => strings(&mut fields, 2),
        op::SCHEMA => {
            fields.take::<2>()?;
            strings(&mut fields, 2)?;
            fields.block().map(drop)
        }
        op::CHANNEL => {
            fields.take::<4>()?;
            strings(&mut fields, 2)?;
            map(&mut fields)
        }
        op::MESSAGE_INDEX => {
            fields.take::<2>()?;
            entries(&mut fields, 8 + 8)
        }
        op::CHUNK_INDEX => {
            fields.take::<{ 4 * 8 }>()?;
            entries(&mut fields, 2 + 8)?;
            fields.take::<8>()?;
            strings(&mut fields, 1)
        }
        op::ATTACHMENT_INDEX => {
            fields.take::<{ 5 * 8 }>()?;
            strings(&mut fields, 2)
        }
        op::STATISTICS => {
            fields.take::<{ 8 + 2 + 4 * 4 + 2 * 8 }>()?;
            entries(&mut fields, 2 + 8)
        }
        op::METADATA => {
            strings(&mut fields, 1)?;
            map(&mut fields)
        }
        op::METADATA_INDEX => {
            fields.take::<{ 2 * 8 }>()?;
            strings(&mut fields, 1)
        }
        _ => Some(()),
    }
}

/// A block of entries of this size. `mcap` reads on beyond a block that ends within an entry.
fn entries(fields: &mut Fields, size: usize) -> Option<()> {
    fields.block()?.len().is_multiple_of(size).then_some(())
}

fn strings(fields: &mut Fields, count: usize) -> Option<()> {
    (0..count).try_for_each(|_| fields.block().map(drop))
}

/// A block of pairs of strings.
fn map(fields: &mut Fields) -> Option<()> {
    let mut pairs = Fields(fields.block()?);
    while !pairs.0.is_empty() {
        strings(&mut pairs, 2)?;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_that_ends_within_an_entry_is_not_read_on() {
        let whole = [vec![0; 32], 10_u32.to_le_bytes().to_vec(), vec![1; 10]].concat();
        let rest = [vec![0; 8], vec![0; 4], vec![0; 16]].concat();
        assert!(parse_record(op::CHUNK_INDEX, &[whole.clone(), rest].concat()).is_ok());
        // Two bytes more: what is behind them would be read as part of an entry, and the words
        // behind that as the length of a name, 4 GB.
        let mut lying = whole;
        lying[32] = 12;
        lying.extend([1; 2]);
        let rest = [vec![0; 8], vec![0; 4], vec![0xff; 16]].concat();
        assert!(parse_record(op::CHUNK_INDEX, &[lying, rest].concat()).is_err());
        let statistics = [vec![0; 42], 3_u32.to_le_bytes().to_vec(), vec![0; 3]].concat();
        assert!(parse_record(op::STATISTICS, &statistics).is_err());
    }
}
