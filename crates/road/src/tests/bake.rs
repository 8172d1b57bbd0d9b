//! Networks as bytes and back.

use std::sync::Arc;

use bytemuck::{cast_slice, cast_slice_mut};

use super::{
    shared_maps,
    small::{JOINED, text},
};
use crate::{Network, SharedBytes, bake::read, build::built};

/// Bytes with the alignment of f64.
struct Aligned {
    words: Vec<u64>,
    length: usize,
}

impl AsRef<[u8]> for Aligned {
    fn as_ref(&self) -> &[u8] {
        &cast_slice(&self.words)[..self.length]
    }
}

fn lent(bytes: &[u8]) -> SharedBytes {
    let mut words = vec![0u64; bytes.len().div_ceil(8)];
    cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
    Arc::new(Aligned { words, length: bytes.len() })
}

/// A map with a few elements of every kind.
fn everything() -> String {
    text(JOINED)
        .replacen(
            "</road>",
            r#"<type s="0" type="town"><speed max="50" unit="km/h"/></type>
<objects><object id="1" type="pole" s="0" t="0" height="2" width="0.4" name="é">
<repeat s="10" length="20" distance="5" tStart="-4" tEnd="-8" heightStart="1" heightEnd="3"/></object>
<object id="2" type="parkingSpace" s="5" t="6"><parkingSpace access="all"/><outline><cornerLocal u="0" v="0" z="0"/><cornerLocal u="1" v="0" z="0"/><cornerLocal u="0" v="1" z="0"/></outline></object>
<tunnel id="t" s="1" length="9" type="standard" lighting="0.5"/></objects>
<signals><signal id="s" s="5" t="-2" orientation="+" type="1000001" dynamic="yes"><validity fromLane="-1" toLane="-1"/><positionInertial x="1" y="2" z="3" hdg="0"/></signal></signals></road>"#,
            1,
        )
        .replace(
            "</OpenDRIVE>",
            r#"<road name="through" length="10" id="3" junction="4"><planView><geometry s="0" x="0" y="50" hdg="1" length="10"><paramPoly3 pRange="normalized" aU="0" bU="10" cU="0" dU="0" aV="0" bV="0" cV="1" dV="-0.5"/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0"/></center><right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"><type name="x" width="0.1"><line length="3" space="6" tOffset="0" sOffset="0"/></type></roadMark><material sOffset="0" surface="gravel" friction="0.5"/><access sOffset="0" rule="deny" restriction="bus"/><speed sOffset="0" max="9"/></lane></right></laneSection></lanes></road>
<controller id="c" name="lights"><control signalId="s" type="0"/></controller>
<junction id="4" name="j"><connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start"><laneLink from="-1" to="-1"/></connection><controller id="c"/></junction>
<junctionGroup id="g" type="roundabout"><junctionReference junction="4"/></junctionGroup>
<userData code="a" value="b"/><include file="other"/></OpenDRIVE>"#,
        )
}

#[test]
fn a_network_survives_serialisation() {
    let mut maps = shared_maps();
    maps.push(("everything".to_owned(), everything()));
    for (name, text) in maps {
        let network = built(&text, 1000, 1).expect("a map");
        let bytes = network.to_bytes();
        assert!(bytes == built(&text, 1000, 2).expect("a map").to_bytes(), "{name}: other bytes");
        for threads in [1, 2, 3, 8] {
            let again = read(lent(&bytes), threads).expect("its own bytes");
            // Not by assert_eq: it would print whole maps.
            assert!(again == network, "{name} with {threads} threads");
            assert!(again.to_bytes() == bytes, "{name}: the bytes of what was read");
        }
    }
}

#[test]
fn damaged_bytes_are_rejected() {
    let whole = Network::parse(&everything()).expect("a map").to_bytes();
    for length in 0..whole.len() {
        assert!(Network::from_bytes(lent(&whole[..length])).is_none(), "{length} bytes");
    }
    assert!(Network::from_bytes(lent(&[&whole[..], b"more"].concat())).is_none());
    // Changed numbers may go unnoticed: checksums are the caller's task. But nothing panics, and
    // the index never refers to a lane that does not exist.
    let mut refused = 0;
    for at in 0..whole.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] ^= flip;
            refused += u32::from(Network::from_bytes(lent(&bytes)).is_none());
        }
    }
    assert!(refused > 100, "{refused} refused");
}

#[test]
fn misaligned_bytes_are_rejected() {
    let bytes = Network::parse(&everything()).expect("a map").to_bytes();
    struct Askew(Vec<u64>, usize);
    impl AsRef<[u8]> for Askew {
        fn as_ref(&self) -> &[u8] {
            &cast_slice(&self.0)[4..4 + self.1]
        }
    }
    let mut words = vec![0u64; bytes.len() / 8 + 2];
    cast_slice_mut(&mut words)[4..4 + bytes.len()].copy_from_slice(&bytes);
    assert!(Network::from_bytes(Arc::new(Askew(words, bytes.len()))).is_none());
}
