//! What is fixed for an episode: the map, its objects, the blueprints, and files for clients.

use glam::Vec3;

use crate::{
    args::RpcError,
    blueprints,
    calls::call::{Call, StaticCall},
    statics::Statics,
    traffic_managers::DEFAULT_PORT,
    wire::{Bounds, write_transform},
};

/// The folder of CARLA's maps.
pub(super) const FOLDER: &str = "Carla/Maps/";
/// CARLA's tag that matches every object.
const ANY: u32 = 255;

pub(super) fn definitions(call: &mut StaticCall) -> Result<(), RpcError> {
    let all = blueprints::definitions();
    call.out.list(all.len());
    all.iter().for_each(|definition| definition.write(call.out));
    Ok(())
}

pub(super) fn info(call: &mut StaticCall) -> Result<(), RpcError> {
    let points = client_lib::spawn_poses(call.statics.network());
    let name = call.statics.map_name();
    call.out.list(2).text(&format!("{FOLDER}{name}")).list(points.len());
    points.iter().for_each(|pose| write_transform(pose, call.out));
    Ok(())
}

pub(super) fn open_drive(call: &mut StaticCall) -> Result<(), RpcError> {
    call.out.text(call.statics.readable_open_drive());
    Ok(())
}

/// Returns the files of the map that clients store on their own disk, with their names: the map's
/// text and the navigation mesh. CARLA's third one is a cache of its own traffic manager.
fn map_files(statics: &Statics) -> Vec<(String, &[u8])> {
    let text = statics.readable_open_drive();
    let mut files =
        vec![(format!("{FOLDER}OpenDrive/{}.xodr", statics.map_name()), text.as_bytes())];
    files.extend(statics.navigation().map(|file| (file.name.clone(), &file.file[..])));
    files
}

/// Returns the names of the map's files in a folder of its own; an empty one stands for all.
pub(super) fn files(call: &mut StaticCall) -> Result<(), RpcError> {
    let folder = call.args.text()?.trim_matches('/');
    let mut files = map_files(&call.statics);
    files.retain(|(name, _)| name.contains(folder));
    call.out.list(files.len());
    for (name, _) in &files {
        call.out.text(name);
    }
    Ok(())
}

pub(super) fn file(call: &mut StaticCall) -> Result<(), RpcError> {
    let wanted = call.args.text()?;
    let files = map_files(&call.statics);
    let found = files.iter().find(|(name, _)| !wanted.is_empty() && name.ends_with(wanted));
    let (_, file) = found.ok_or_else(|| RpcError::from(format!("unknown file {wanted:?}")))?;
    call.out.bin(file);
    Ok(())
}

pub(super) fn navigation_mesh(call: &mut StaticCall) -> Result<(), RpcError> {
    call.out.bin(call.statics.navigation().map_or(&[], |navigation| &navigation.file));
    Ok(())
}

/// Returns the address and the actual port of the traffic manager of a port: the address to which this client has
/// connected.
pub(super) fn traffic_manager(call: &mut StaticCall) -> Result<(), RpcError> {
    let wanted = if call.args.len() > 0 { call.args.u32()? } else { DEFAULT_PORT.into() };
    let wanted = u16::try_from(wanted).map_err(|_| format!("{wanted} is no port"))?;
    let port = (call.manager_port)(wanted)?;
    call.out.list(2).text(&call.peer.local.ip().to_string()).uint(port.into());
    Ok(())
}

fn bounds(object: &town::Object) -> Bounds {
    Bounds {
        center_m: object.center.to_array(),
        half_extents_m: object.half_extents_m.to_array(),
        yaw_rad: object.yaw_rad,
        actor: 0,
    }
}

/// Returns the bounding boxes of all objects and actors with a tag, in world space.
pub(super) fn level_boxes(call: &mut Call) -> Result<(), RpcError> {
    let tag = call.args.u32()?;
    let statics = call.bridge.statics_with_town();
    let objects = statics.town().objects.iter();
    let mut boxes: Vec<_> =
        objects.filter(|o| tag == ANY || o.tag as u32 == tag).map(bounds).collect();
    let (world, blueprints) = (call.bridge.client.world(), call.bridge.client.blueprints());
    for actor in world.states() {
        let info = blueprints.get(actor.blueprint as usize);
        let Some(info) = info.filter(|info| tag == ANY || u32::from(info.tag) == tag) else {
            continue;
        };
        let center = actor.pose.position() + actor.pose.rotation() * Vec3::from(info.center_m);
        let ahead = actor.pose.rotation() * Vec3::X;
        boxes.push(Bounds {
            center_m: center.to_array(),
            half_extents_m: info.half_extents_m,
            yaw_rad: ahead.y.atan2(ahead.x),
            actor: actor.actor_id.0,
        });
    }
    call.out.list(boxes.len());
    boxes.iter().for_each(|b| b.write(call.out));
    Ok(())
}

pub(super) fn environment_objects(call: &mut StaticCall) -> Result<(), RpcError> {
    let tag = call.args.u32()?;
    let objects = &call.statics.town().objects;
    let those = objects.iter().enumerate().filter(|(_, o)| tag == ANY || o.tag as u32 == tag);
    let those: Vec<_> = those.collect();
    call.out.list(those.len());
    for (index, object) in those {
        let pose = client_lib::Pose::level(object.center, object.yaw_rad);
        call.out.list(5);
        write_transform(&pose, call.out);
        bounds(object).write(call.out);
        call.out.uint(index as u64 + 1).text(&name(index, object)).uint(object.tag as u64);
    }
    Ok(())
}

pub(super) fn object_names(call: &mut StaticCall) -> Result<(), RpcError> {
    let objects = &call.statics.town().objects;
    call.out.list(objects.len());
    for (index, object) in objects.iter().enumerate() {
        call.out.text(&name(index, object));
    }
    Ok(())
}

fn name(index: usize, object: &town::Object) -> String {
    format!("{:?}_{:?}_{index}", object.layer, object.tag)
}
