use super::*;

fn decode(bytes: &[u8]) -> Result<Value, DecodeError> {
    read(&mut &bytes[..], &mut Budget::new(1000, 1000))
}

/// A request as the official client sends it: `tick_cue` with its metadata.
const TICK: &[u8] = b"\x94\x00\x09\xa8tick_cue\x91\x91\xc2";

#[test]
fn a_request_of_the_official_client_is_read() {
    let metadata = Value::List(vec![Value::List(vec![Value::Bool(false)])]);
    let request = vec![Value::Int(0), Value::Int(9), Value::Text("tick_cue".into()), metadata];
    assert_eq!(decode(TICK).unwrap(), Value::List(request));
}

#[test]
fn packed_values_are_read_back() {
    let mut pack = Pack::new();
    pack.list(9).nil().bool(true).uint(70_000).int(-7).int(-70_000).f32(0.5).f64(1e300);
    pack.text(&"x".repeat(300)).bin(&[7; 400]);
    let Value::List(values) = decode(pack.bytes()).unwrap() else { panic!("no list") };
    assert_eq!(values[..4], [Value::Nil, Value::Bool(true), Value::Int(70_000), Value::Int(-7)]);
    assert_eq!(values[4..7], [Value::Int(-70_000), Value::Float(0.5), Value::Float(1e300)]);
    assert_eq!(values[7], Value::Text("x".repeat(300)));
    assert_eq!(values[8], Value::Bytes(vec![7; 400]));
}

#[test]
fn every_truncation_of_a_request_is_an_error() {
    assert!(matches!(decode(&[]), Err(DecodeError::Ended)));
    for len in 1..TICK.len() {
        assert!(matches!(decode(&TICK[..len]), Err(DecodeError::Truncated)), "{len} bytes");
    }
}

#[test]
fn a_claimed_length_reserves_no_memory() {
    for head in [0xdd, 0xdf, 0xdb, 0xc6] {
        let ended = decode(&[head, 0xff, 0xff, 0xff, 0xff, 1, 2, 3]);
        assert!(
            matches!(ended, Err(DecodeError::Truncated | DecodeError::TooLong)),
            "{head:#x}: {ended:?}"
        );
    }
}

#[test]
fn lists_that_are_nested_too_deeply_are_rejected() {
    assert!(matches!(decode(&[0x91; 1000]), Err(DecodeError::TooDeep)));
}

#[test]
fn the_request_after_one_that_exceeds_the_budget_is_read() {
    let mut pack = Pack::new();
    pack.list(2).text(&"x".repeat(5000)).list(3000);
    for i in 0..3000 {
        pack.uint(i);
    }
    let bytes = [pack.bytes(), TICK].concat();
    let mut input = &bytes[..];
    let mut budget = Budget::new(1000, 1000);
    read(&mut input, &mut budget).unwrap();
    assert!(budget.is_exceeded);
    assert_eq!(input, TICK);
}

fn request(bytes: &[u8]) -> Result<Request, DecodeError> {
    read_request(&mut &bytes[..], &mut Budget::new(1000, 1000))
}

#[test]
fn requests_and_notifications_are_read_in_every_form_of_their_lists() {
    let metadata = vec![Value::List(vec![Value::Bool(false)])];
    let tick = Request { id: Some(9), method: "tick_cue".into(), params: metadata };
    assert_eq!(request(TICK).unwrap(), tick);
    for head in [&b"\xdc\x00\x04"[..], b"\xdd\x00\x00\x00\x04"] {
        assert_eq!(request(&[head, &TICK[1..]].concat()).unwrap(), tick);
    }
    let sent = request(b"\x93\x02\xd9\x08tick_cue\x91\x91\xc2").unwrap();
    assert_eq!((sent.id, sent.method.as_str()), (None, "tick_cue"));
}

#[test]
fn what_is_not_a_request_is_rejected_at_its_first_wrong_byte() {
    for bytes in [
        &b"POST / HTTP/1.1\r\n\r\n\x94\x00\x09\xa8tick_cue\x91\x91\xc2"[..],
        b"\x16\x03\x01",
        b"\x93\x00\x09\xa8",
        b"\x94\x01\x09\xc0",
        b"\x94\x02\x09\xa8",
        b"\x94\x00\xa1x",
        b"\x94\x00\x09\x07",
        b"\x94\x00\x09\xdb\x00\x00\x00\x08tick_cue\x90",
        b"\x94\x00\x09\xa8tick_cue\x80",
        b"\x94\x00\x09\xda\x10\x00",
        b"\xdd\xff\xff\xff\xff\x00",
    ] {
        let ended = request(bytes);
        assert!(matches!(ended, Err(DecodeError::NotARequest { .. })), "{bytes:x?}: {ended:?}");
    }
}

#[test]
fn a_request_that_exceeds_the_budget_keeps_its_id_and_its_name() {
    let mut pack = Pack::new();
    pack.list(4).uint(0).uint(7).text("apply_batch").list(2).list(3000);
    for i in 0..3000 {
        pack.uint(i);
    }
    pack.bool(true);
    let bytes = [pack.bytes(), TICK].concat();
    let (mut input, mut budget) = (&bytes[..], Budget::new(1000, 1000));
    let read = read_request(&mut input, &mut budget).unwrap();
    assert!(budget.is_exceeded);
    assert_eq!((read.id, read.method.as_str()), (Some(7), "apply_batch"));
    assert_eq!(input, TICK);
}

#[test]
fn large_requests_share_the_memory_of_a_pool() {
    let pool = std::sync::Arc::new(Pool::of_mib(2));
    let bytes = |mib: usize| {
        let mut pack = Pack::new();
        pack.list(3).uint(2).text("send").list(1).text(&"x".repeat(mib << 20));
        pack.into_bytes()
    };
    let budget_of = |bytes: &[u8]| {
        let mut budget = Budget::of_pool(1000, 1 << 30, &pool);
        read_request(&mut &bytes[..], &mut budget).unwrap();
        budget
    };
    let two = bytes(2);
    let first = budget_of(&two);
    assert!(!first.is_exceeded);
    assert!(budget_of(&two).is_exceeded, "the first request holds the whole pool");
    // What needs no more than every request may take is not affected.
    assert!(!budget_of(TICK).is_exceeded);
    drop(first);
    assert!(!budget_of(&two).is_exceeded);
    assert!(budget_of(&bytes(4)).is_exceeded);
}
