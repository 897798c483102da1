//! An action server of nav2_msgs/action/NavigateToPose. The x of a goal says what becomes of it: from 20 on it is active
//! until its cancellation is asked for, which it takes; 10 is aborted with an error code, others succeed. The feedback is
//! the pose of the goal.

use std::iter;

use futures::join;
use ros2_client::{action::GoalEndStatus, Message};
use serde::{Deserialize, Serialize};

use crate::{
    trajectories::{Header, Time},
    Peer,
};

#[derive(Clone, Default, Serialize, Deserialize)]
struct Point {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Pose {
    position: Point,
    orientation: Quaternion,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Pose,
}

#[derive(Clone, Serialize, Deserialize)]
struct Goal {
    pose: PoseStamped,
    behavior_tree: String,
}

#[derive(Clone, Serialize, Deserialize)]
struct Outcome {
    error_code: u16,
    error_msg: String,
}

#[derive(Clone, Serialize, Deserialize)]
struct Feedback {
    current_pose: PoseStamped,
    navigation_time: Time,
    estimated_time_remaining: Time,
    number_of_recoveries: i16,
    distance_remaining: f32,
}

impl Message for Goal {}
impl Message for Outcome {}
impl Message for Feedback {}

pub async fn serve(mut peer: Peer) {
    let server = peer.action_server::<Goal, Outcome, Feedback>(
        "/navigate_to_pose",
        "nav2_msgs",
        "NavigateToPose",
    );
    println!("ready");
    let work = async {
        loop {
            let new = server.receive_new_goal().await.expect("a goal");
            let goal = server.get_new_goal(new.clone()).expect("the goal");
            let (frame, to) = (&goal.pose.header.frame_id, &goal.pose.pose);
            let x = to.position.x;
            println!(
                "goal {x} {} {frame} {} {}",
                to.position.y, to.orientation.w, goal.behavior_tree
            );
            let accepted = server.accept_goal(new).await.expect("an acceptance");
            let sent = server.start_executing_goal(accepted).await.expect("a goal");
            let feedback = Feedback {
                current_pose: goal.pose.clone(),
                navigation_time: Time::default(),
                estimated_time_remaining: Time::default(),
                number_of_recoveries: -1,
                distance_remaining: x as f32 / 2.0,
            };
            let published = server.publish_feedback(sent.clone(), feedback).await;
            assert!(published.is_ok(), "feedback");
            let mut end = GoalEndStatus::Succeeded;
            if x == 10.0 {
                end = GoalEndStatus::Aborted;
            } else if x >= 20.0 {
                let asked = server.receive_cancel_request().await.expect("a request");
                let ids = iter::once(sent.goal_id());
                let taken = server.respond_to_cancel_requests(&asked, ids);
                taken.await.expect("a response");
                end = GoalEndStatus::Canceled;
            }
            println!("end {x} {end:?}");
            let outcome = Outcome {
                error_code: match x {
                    10.0 => 9003,
                    11.0 => 9002,
                    _ => 0,
                },
                error_msg: "ü".into(),
            };
            let sent = server.send_result_response(sent, end, outcome).await;
            sent.expect("a result");
        }
    };
    join!(work, peer.tell_matches());
}
