//! An action server of control_msgs/action/FollowJointTrajectory; /points has the point of each goal. The first position of a goal says what becomes of it:
//! from 100 on it is rejected; from 20 on it is active until its cancellation is asked for, which 90 ignores and the others
//! take; 80 refuses it, and is active until a message of /go; 60 is accepted only after one. 10 is aborted, others succeed.

use std::{iter, pin::pin};

use futures::{join, StreamExt};
use ros2_client::{action::GoalEndStatus, Message, MessageTypeName};
use serde::{Deserialize, Serialize};

use crate::{name, reliable, Peer};

#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Time {
    pub sec: i32,
    pub nanosec: u32,
}

#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Header {
    pub stamp: Time,
    pub frame_id: String,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Point {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: Time,
}

/// Transforms have three numbers and a quaternion, twists twice three numbers.
#[derive(Clone, Default, Serialize, Deserialize)]
struct MultiPoint {
    transforms: Vec<[f64; 7]>,
    velocities: Vec<[f64; 6]>,
    accelerations: Vec<[f64; 6]>,
    time_from_start: Time,
}

#[derive(Clone, Serialize, Deserialize)]
struct Trajectory<P> {
    header: Header,
    joint_names: Vec<String>,
    points: Vec<P>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Tolerance {
    name: String,
    limits: [f64; 3],
}

#[derive(Clone, Serialize, Deserialize)]
struct ComponentTolerance {
    joint_name: String,
    component: u16,
    limits: [f64; 3],
}

#[derive(Clone, Serialize, Deserialize)]
struct Goal {
    trajectory: Trajectory<Point>,
    multi_dof_trajectory: Trajectory<MultiPoint>,
    path_tolerance: Vec<Tolerance>,
    component_path_tolerance: Vec<ComponentTolerance>,
    goal_tolerance: Vec<Tolerance>,
    component_goal_tolerance: Vec<ComponentTolerance>,
    goal_time_tolerance: Time,
}

#[derive(Clone, Serialize, Deserialize)]
struct Outcome {
    error_code: i32,
    error_string: String,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Feedback {
    header: Header,
    joint_names: Vec<String>,
    desired: Point,
    actual: Point,
    error: Point,
    multi_dof_joint_names: Vec<String>,
    multi_dof_desired: MultiPoint,
    multi_dof_actual: MultiPoint,
    multi_dof_error: MultiPoint,
}

impl Message for Point {}
impl Message for Goal {}
impl Message for Outcome {}
impl Message for Feedback {}

pub async fn serve(mut peer: Peer) {
    let server = peer.action_server::<Goal, Outcome, Feedback>(
        "/gantry",
        "control_msgs",
        "FollowJointTrajectory",
    );
    let go = peer.subscription::<String>("/go", "String", reliable());
    let kind = MessageTypeName::new("trajectory_msgs", "JointTrajectoryPoint");
    let topic = peer.node.create_topic(&name("/points"), kind, &reliable());
    let points = peer
        .node
        .create_publisher::<Point>(&topic.expect("a topic"), None)
        .expect("a publisher");
    println!("ready");
    let work = async {
        let mut go = pin!(go.async_stream());
        loop {
            let new = server.receive_new_goal().await.expect("a goal");
            let goal = server.get_new_goal(new.clone()).expect("the goal");
            let target = goal.trajectory.points[0].positions[0];
            println!("goal {target} {}", goal.trajectory.joint_names.join(" "));
            let point = goal.trajectory.points[0].clone();
            assert!(points.async_publish(point).await.is_ok(), "a point");
            if target >= 100.0 {
                server.reject_goal(new).await.expect("a rejection");
                continue;
            }
            if target == 60.0 {
                go.select_next_some().await.expect("a message");
            }
            let accepted = server.accept_goal(new).await.expect("an acceptance");
            let goal = server.start_executing_goal(accepted).await.expect("a goal");
            let mut feedback = Feedback::default();
            feedback.actual.positions = vec![target];
            let published = server.publish_feedback(goal.clone(), feedback).await;
            assert!(published.is_ok(), "feedback");
            let mut end = GoalEndStatus::Succeeded;
            if target == 10.0 {
                end = GoalEndStatus::Aborted;
            } else if target >= 20.0 {
                let asked = server.receive_cancel_request().await.expect("a request");
                println!("cancel {target}");
                if target == 80.0 {
                    let refused = server.respond_to_cancel_requests(&asked, iter::empty());
                    refused.await.expect("a refusal");
                    go.select_next_some().await.expect("a message");
                } else {
                    let ids = iter::once(goal.goal_id());
                    let taken = server.respond_to_cancel_requests(&asked, ids);
                    taken.await.expect("a response");
                    if target != 90.0 {
                        end = GoalEndStatus::Canceled;
                    }
                }
            }
            println!("end {target} {end:?}");
            let outcome = Outcome {
                error_code: if target == 11.0 { -5 } else { 0 },
                error_string: "ü".into(),
            };
            let sent = server.send_result_response(goal, end, outcome).await;
            sent.expect("a result");
        }
    };
    join!(work, peer.tell_matches());
}
